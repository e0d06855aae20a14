"""Rendering: from a scene and a plan to a film of named channels."""
