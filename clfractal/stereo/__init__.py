"""Stereo geometry for programs of one's own: each eye's frustum and attitude, and the parallax of points.

The same functions place the eyes of a stereo scene when it is rendered; `docs/stereo.md` shows their use.
"""

from clfractal.stereo.eyes import attitude as attitude
from clfractal.stereo.eyes import degrees as degrees
from clfractal.stereo.eyes import eye_distance as eye_distance
from clfractal.stereo.eyes import eye_views as eye_views
from clfractal.stereo.eyes import frustum as frustum
from clfractal.stereo.eyes import parallax as parallax
