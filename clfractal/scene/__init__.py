"""Scenes: the schema of a scene file, and reading one with located errors."""
