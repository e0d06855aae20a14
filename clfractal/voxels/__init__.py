"""Grids of voxels: filling them, their normals and octree, and their exchange."""
