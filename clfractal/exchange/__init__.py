"""Scenes of other programs as scenes of this one: plain data, and what of them was not taken over."""
