"""Parts of a layered material; what they scatter light by is told in `kernels/elements/materials`."""
