"""Settings shared by every test."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

from clfractal.device.cache_folder import set_drivers_folder

# Where it belongs, although a test may be the first to use OpenCL that has a cache folder of its own.
set_drivers_folder()

# The same examples on every run: a failure must be repeatable on another machine.
settings.register_profile(
    "repeatable",
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    max_examples=100,
)
settings.load_profile("repeatable")
