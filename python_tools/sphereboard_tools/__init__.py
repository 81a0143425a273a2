"""Checks of sphereboard's output by independent implementations.

``main`` reads the command line; ``check_segmentation`` and ``check_mesh`` are its commands, each usable as a library.
Masks are boolean arrays of shape (rows, columns); pictures are 8-bit RGB arrays of shape (rows, columns, 3).
"""

__version__ = "0.1.0"
