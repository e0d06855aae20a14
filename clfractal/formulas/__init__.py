"""Formulas: one text, read as mathematics by NumPy, mpmath and OpenCL."""
