"""What scenes consist of, one kind a file; each folder holds the kinds of one thing."""
