"""The version of Rumo."""

__version__ = "0.1.0"
