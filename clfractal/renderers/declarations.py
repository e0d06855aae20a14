"""What all programs of surfaces are told of their data in C."""

from __future__ import annotations

from clfractal.device.orbit import ORBIT
from clfractal.renderers.kinds import kind_text
from clfractal.renderers.maps import MAP
from clfractal.renderers.march import MARCH
from clfractal.renderers.materials import PBR
from clfractal.renderers.objects import OBJECT
from clfractal.renderers.passes import SAMPLING
from clfractal.renderers.records import LIGHT, MATERIAL, VIEW

STRUCTS = (VIEW, SAMPLING, ORBIT, MARCH, LIGHT, MATERIAL, PBR, MAP, OBJECT)


def struct_text() -> str:
    """The declarations of all records, with the numbers of kinds, for inclusion after `lanes.h`."""
    return kind_text() + "".join(struct.c_text() for struct in STRUCTS)
