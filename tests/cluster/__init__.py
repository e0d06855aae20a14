"""Tests with schedulers and workers that are real processes; `make cluster` runs them."""
