"""Shapes of objects, which `kernels/elements/shapes` knows by the same names."""
