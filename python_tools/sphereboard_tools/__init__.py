"""Checks of sphereboard's output by independent implementations."""

__version__ = "0.1.0"
