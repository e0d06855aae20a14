"""Stereo geometry for programs of one's own: each eye's frustum and attitude, and the parallax of points.

The same functions place the eyes of a stereo scene when it is rendered; `docs/stereo.md` shows their use.
"""

from clfractal.optics.stereo import attitude as attitude
from clfractal.optics.stereo import degrees as degrees
from clfractal.optics.stereo import eye_distance as eye_distance
from clfractal.optics.stereo import eye_views as eye_views
from clfractal.optics.stereo import frustum as frustum
from clfractal.optics.stereo import parallax as parallax
