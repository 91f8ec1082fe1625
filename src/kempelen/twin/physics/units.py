"""The one place where millimetres meet MuJoCo's SI units."""

METRES = 1e-3
"""Metres in a millimetre."""

KILOGRAMS = 1e-3
"""Kilograms in a gram."""
