"""What every program needs on GPUs that are not here, told by their compilers: `make gpu-check`."""
