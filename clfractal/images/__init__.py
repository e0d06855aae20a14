"""Finished pixels: tiles, films in memory and on disk, two eyes' pictures in one, files."""
