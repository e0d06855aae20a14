"""Lights; of those with records of their own `kernels/elements/lights` has files of the same names."""
