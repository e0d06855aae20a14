"""Finished pixels: tiles, framebuffers in memory and on disk, two eyes' pictures in one, files."""
