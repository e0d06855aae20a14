"""What all programs of surfaces are told of their data in C."""

from __future__ import annotations

from clfractal.device.orbit import ORBIT
from clfractal.geometry.objects import OBJECT
from clfractal.integrators.march import MARCH
from clfractal.integrators.passes import SAMPLING
from clfractal.integrators.records import MATERIAL, VIEW
from clfractal.shading.kind_numbers import kind_text
from clfractal.shading.light_records import LIGHT
from clfractal.shading.maps import MAP
from clfractal.shading.materials import PBR

STRUCTS = (VIEW, SAMPLING, ORBIT, MARCH, LIGHT, MATERIAL, PBR, MAP, OBJECT)


def struct_text() -> str:
    """The declarations of all records, with the numbers of kinds, for inclusion after `lanes.h`."""
    return kind_text() + "".join(struct.c_text() for struct in STRUCTS)
