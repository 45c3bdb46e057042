"""The Python interface: what scripts and notebooks take from ``explorer`` itself (docs/python.md)."""
