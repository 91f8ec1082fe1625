"""Machines driven by GRBL 1.1 over a serial line."""
