"""Kempelen: the chess robot that anyone can run."""

from importlib.metadata import version

__version__ = version("kempelen")
