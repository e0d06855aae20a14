"""What colours of a surface, and values of its materials, follow; as in `kernels/elements/colorings`."""
