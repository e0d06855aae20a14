"""Devices: choosing one, building programs for it, measuring what suits it."""
