"""What scatters and gives light, as kernels read it: materials, maps, lights on the set, environments."""
