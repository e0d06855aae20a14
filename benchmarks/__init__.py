"""Benchmarks: this engine beside other programs, in one session on one machine."""
