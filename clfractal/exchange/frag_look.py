"""The camera, light, colours and background of a fragment's preset, as those of a scene.

What their renderer computes is shown by a curve, `Gamma`; in old presets there is none, and numbers are what a screen
shows. Ours are amounts of light.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from clfractal.exchange.look import decoded
from clfractal.exchange.view import SENSOR

_SRGB = 2.2
_LARGEST = 1e6
DEFAULTS: Mapping[str, tuple[float, ...]] = {
    "FOV": (0.4,),
    "Eye": (0.0, 0.0, -10.0),
    "Target": (0.0, 0.0, 0.0),
    "Up": (0.0, 1.0, 0.0),
    "Gamma": (1.0,),
    "Exposure": (1.0,),
    "ToneMapping": (1.0,),
    "FudgeFactor": (1.0,),
    "Aperture": (0.0,),
    "FocalPlane": (1.0,),
    "AO": (0.0, 0.0, 0.0, 0.7),
    "Specular": (0.4,),
    "SpecularExp": (16.0,),
    "SpotLight": (1.0, 1.0, 1.0, 0.4),
    "SpotLightDir": (0.1, 0.1),
    "CamLight": (1.0, 1.0, 1.0, 1.0),
    "CamLightMin": (0.0,),
    "Glow": (1.0, 1.0, 1.0, 0.0),
    "GlowMax": (20.0,),
    "Fog": (0.0,),
    "HardShadow": (0.0,),
    "Reflection": (0.0,),
    "BaseColor": (1.0, 1.0, 1.0),
    "OrbitStrength": (0.0,),
    "X": (0.5, 0.6, 0.6, 0.7),
    "Y": (1.0, 0.6, 0.0, 0.4),
    "Z": (0.8, 0.78, 1.0, 0.5),
    "R": (0.4, 0.7, 1.0, 0.12),
    "BackgroundColor": (0.6, 0.6, 0.45),
    "CycleColors": (0.0,),
    "Cycles": (1.1,),
    "EnableFloor": (0.0,),
    "FloorNormal": (0.0, 0.0, 1.0),
    "FloorHeight": (0.0,),
    "FloorColor": (1.0, 1.0, 1.0),
}
"""What their renderer begins with, where a preset does not say it."""
METHOD = frozenset(
    (
        *("Detail", "DetailAO", "MaxRaySteps", "MaxDistance", "Dither", "NormalBackStep", "BoundingSphere"),
        *("AntiAlias", "AntiAliasBlur", "AntiAliasScale", "GaussianWeight", "MaxRayStepsDiv", "AutoFocus"),
        *(
            "DebugSun",
            "DebugInside",
            "DebugNormals",
            "ShowDepth",
            "DepthToAlpha",
            "DepthMagnitude",
        ),
        *(
            "QualityShadows",
            "ShadowSoft",
            "SpecularMax",
            "Samples",
            "Stratify",
            "ClarityPower",
            "BoundingSphere",
        ),
    )
)
"""Keys of how their rays find the surface, and of what is shown while one looks for mistakes."""
_TRAPS = (("X", (1, 0, 0)), ("Y", (0, 1, 0)), ("Z", (0, 0, 1)), ("R", None))
_STOPS = 48
_FARTHEST = 2.0
"""Distances of the orbit that colours are told for."""
_USUAL = 0.1
_USUAL_STEPS = 20
_GLOW = 0.15


@dataclass
class Look:
    """Numbers of a preset, and which of them were asked for."""

    values: Mapping[str, tuple[float, ...]]
    remarks: list[str]
    seen: set[str] = field(default_factory=set)

    def numbers(self, key: str) -> tuple[float, ...]:
        """The numbers of a key, as many as the renderer's own."""
        self.seen.add(key)
        own = DEFAULTS[key]
        found = self.values.get(key, own)
        return tuple(found[: len(own)]) + own[len(found) :]

    def number(self, key: str) -> float:
        """The number of a key."""
        return self.numbers(key)[0]

    @property
    def gamma(self) -> float:
        """Their curve's exponent; 1 for old presets."""
        return min(max(self.number("Gamma"), 0.2), 5.0)

    def amount(self, value: float) -> float:
        """An amount of their light as one of ours."""
        return float(f"{min(max(value, 0.0) ** (_SRGB / self.gamma), _LARGEST):.6g}")

    def shown(self, color: Sequence[float]) -> list[float]:
        """What is shown as it is, as light of ours."""
        return decoded([max(each, 0.0) ** (1 / self.gamma) for each in color])


def view_of(look: Look) -> dict[str, Any]:
    """The sections `image` and `camera`. `FOV` is half of the picture's height at the distance 1."""
    eye, target, up = (list(look.numbers(key)) for key in ("Eye", "Target", "Up"))
    forward = [a - b for a, b in zip(target, eye, strict=True)]
    if math.hypot(*forward) < 1e-12:
        look.remarks.append("Target is where Eye is; the camera looks along z")
        target = [eye[0], eye[1], eye[2] + 1]
        forward = [0.0, 0.0, 1.0]
    if _parallel(up, forward):
        look.remarks.append("Up is along the view; another direction is up")
        up = [0.0, 1.0, 0.0] if not _parallel([0.0, 1.0, 0.0], forward) else [0.0, 0.0, 1.0]
    half = look.number("FOV")
    degrees = math.degrees(2 * math.atan(half)) if half > 0 else 45.0
    camera: dict[str, Any] = {
        "position": eye,
        "target": target,
        "up": up,
        "fov": round(min(max(degrees, 1e-4), 179.0), 9),
    }
    radius, plane = look.number("Aperture"), look.number("FocalPlane")
    if radius > 0 and plane > 0 and half > 0:
        focal = SENSOR / (2 * half)
        camera["f_number"] = min(max(focal / (2 * radius), 0.01), 1e6)
        camera["focus_distance"] = min(plane, 1e6)
    look.seen |= {"EquiRectangular"}
    if look.values.get("EquiRectangular", (0.0,))[0]:
        look.remarks.append("EquiRectangular: the picture is in perspective")
    return {"image": {"width": 960, "height": 720}, "camera": camera}


def look_of(look: Look, camera: dict[str, Any], traps: bool) -> dict[str, Any]:
    """All sections but those of the formula, the camera and the picture's size.

    Args:
        traps: whether the orbit has traps that colours may follow.
    """
    found: dict[str, Any] = {
        "lights": _lights(look, camera),
        "material": _material(look),
        "background": {side: look.shown(look.numbers("BackgroundColor")) for side in ("top", "bottom")},
        "renderer": {"samples": 16 if "f_number" in camera else 4},
    }
    if found["material"].get("reflection", 0) > 0:
        found["renderer"]["bounces"] = 1
    if look.numbers("AO")[3] > 0.2:
        found["renderer"]["ambient_occlusion"] = {"rays": 4}
    glow = look.numbers("Glow")
    if glow[3] > 0:
        # Theirs grows with the steps of rays that pass by, and is whole at `GlowMax` of them; ours is on the surface, too.
        steps = min(_USUAL_STEPS / max(look.number("GlowMax"), 1.0), 1.0)
        strength = _GLOW * look.amount(min(glow[3] * steps, 1.0))
        found["glow"] = {"color": look.shown(glow[:3]), "intensity": round(strength, 6)}
    fog = look.number("Fog")
    if fog > 0:
        # Theirs weakens light by exp(-(fog^2 d)^2): ours is half gone at the same distance.
        density = math.sqrt(math.log(2)) * fog * fog
        found["fog"] = {
            "color": found["background"]["top"],
            "density": float(f"{min(density, _LARGEST):.6g}"),
        }
        found["fog"]["background"] = False
    if look.number("EnableFloor"):
        _floor(look, found)
    exposure = look.number("Exposure")
    output: dict[str, Any] = {}
    if exposure > 0 and exposure != 1:
        output["exposure"] = round(min(max(math.log2(exposure) * _SRGB / look.gamma, -20), 20), 6)
    if look.number("ToneMapping") > 1:
        # 2 to 5 are curves that bright light bends to white.
        output["tone"] = "reinhard"
    if output:
        found["output"] = output
    coloring = _coloring(look, traps)
    if coloring is not None:
        found["coloring"] = coloring
    return found


def _lights(look: Look, camera: dict[str, Any]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    spot, lamp = look.numbers("SpotLight"), look.numbers("CamLight")
    x, y = (part * math.pi for part in look.numbers("SpotLightDir"))
    y /= 2
    place = [math.sin(x) * math.cos(y), math.sin(y) * math.sin(x), math.cos(x)]
    shadow = look.number("HardShadow") > 0
    if spot[3] > 0 and math.hypot(*place) > 1e-9:
        light: dict[str, Any] = {
            "direction": [round(-each, 9) + 0.0 for each in place],
            "color": decoded(spot[:3]),
            "intensity": look.amount(spot[3]),
        }
        found.append(light if shadow else {**light, "shadow": False})
    if lamp[3] > 0:
        found.append(
            {
                "type": "point",
                "position": list(camera["position"]),
                "color": decoded(lamp[:3]),
                "intensity": look.amount(lamp[3] * (1 - _even(look))),
                "shadow": False,
            }
        )
    return found


def _even(look: Look) -> float:
    """The part of the light at the camera that is everywhere: hollows are dark there, as theirs are in all light."""
    return min(max(look.numbers("AO")[3], 0.0), 1.0) / 2


def _material(look: Look) -> dict[str, Any]:
    lamp = look.numbers("CamLight")[3]
    lights = look.amount(look.numbers("SpotLight")[3]) + look.amount(lamp * (1 - _even(look)))
    least = look.amount(max(look.number("CamLightMin") / 2, _even(look)) * lamp)
    found = {
        "color": decoded(look.numbers("BaseColor")),
        "ambient": float(f"{least / max(lights, 0.05):.6g}"),
        "diffuse": 1,
        "specular": round(min(max(look.number("Specular"), 0.0), 1.0) * 0.5, 6),
        # Theirs is a power of the cosine with the half vector, which is about the fourth of Phong's exponent.
        "shininess": round(min(max(look.number("SpecularExp") / 4, 1.0), 10_000.0), 6),
    }
    reflection = min(max(look.number("Reflection"), 0.0), 1.0)
    return {**found, "reflection": reflection} if reflection else found


def _floor(look: Look, found: dict[str, Any]) -> None:
    normal = look.numbers("FloorNormal")
    length = math.hypot(*normal)
    if length < 1e-9:
        return
    unit = [each / length for each in normal]
    height = look.number("FloorHeight")
    found["materials"] = {"floor": {"base": {"color": decoded(look.numbers("FloorColor"))}}}
    found["objects"] = {
        "floor": {
            "type": "plane",
            "position": [round(height * each, 9) + 0.0 for each in unit],
            "normal": [round(each, 9) + 0.0 for each in unit],
            "material": "floor",
        }
    }


def _coloring(look: Look, traps: bool) -> dict[str, Any] | None:
    """Colours by the orbit's trap that is strongest; None: the surface has one colour."""
    strength = min(max(look.number("OrbitStrength"), 0.0), 1.0)
    cycles = look.number("Cycles") if look.number("CycleColors") else 0.0
    base = look.numbers("BaseColor")
    channels = {key: look.numbers(key) for key, _ in _TRAPS}
    strongest, axis = max(_TRAPS, key=lambda each: abs(channels[each[0]][3]) * sum(channels[each[0]][:3]))
    if not strength or not traps or not channels[strongest][3]:
        return None
    others = [key for key, _ in _TRAPS if key != strongest and channels[key][3]]
    if others:
        look.remarks.append(f"colours follow {strongest} alone; {', '.join(others)} are the same everywhere")

    def part(key: str, q: float) -> list[float]:
        red_green_blue, weight = channels[key][:3], channels[key][3]
        if cycles:
            red_green_blue = tuple(0.5 + 0.5 * math.cos(q * cycles + each) for each in red_green_blue)
        return [each * weight * q for each in red_green_blue]

    stops = []
    for place in range(_STOPS + 1):
        q = _FARTHEST * place / _STOPS
        parts = [part(strongest, q), *(part(key, _USUAL) for key in others)]
        mixed = [
            3 * sum(each) * strength + own * (1 - strength) for *each, own in zip(*parts, base, strict=True)
        ]
        stops.append({"at": round(place / _STOPS, 6), "color": decoded(mixed)})
        if len(stops) > 2 and stops[-1]["color"] == stops[-2]["color"] == stops[-3]["color"]:
            del stops[-2]
    trap: dict[str, Any] = {"shape": "point"} if axis is None else {"shape": "plane", "direction": list(axis)}
    return {
        "by": "trap",
        "trap": trap,
        "palette": stops,
        "scale": 1 / _FARTHEST,
        "offset": 0,
        "repeat": False,
    }


def _parallel(one: Sequence[float], other: Sequence[float]) -> bool:
    cross = (
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    )
    return math.hypot(*cross) <= 1e-6 * math.hypot(*one) * math.hypot(*other)
