"""Shapes of orbit traps, which `kernels/elements/traps` knows by the same names."""
