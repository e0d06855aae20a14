"""Light, colours, background, fog and limits of a settings file.

Their colours and intensities are what a screen shows, before their `gamma`; ours are amounts of light, which a screen shows
by the curve of sRGB. A colour becomes that of the same look on a screen. Theirs add light from everywhere and from lamps
as screens show it, ours add amounts, which is less; so lamps are stronger the more light there is from everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from clfractal.exchange.mists import mist_of
from clfractal.exchange.settings import Section, Settings
from clfractal.exchange.surroundings import environment_of, lying_there
from clfractal.exchange.textures import textures_of

Look = Literal["same", "ours"]
LOOKS: tuple[Look, ...] = ("same", "ours")

SURFACE = "the surface"
"""The name of the set's material, where it shows pictures."""

_CURVE = 2.2
"""About the exponent of sRGB's curve, for what may be above 1."""
_LAMPS = 4
_LAMP_FACTOR = 100 / 24
"""What arrives of a lamp of intensity 1 at a distance of 1."""
_LARGEST = 1e6
_FACING = 0.75
"""The cosine at which a surface in the main light is as bright as theirs: at others ours change more slowly."""
_STEPS = 8
"""Of theirs on a way to the surface, times their `DE_factor`: what glow grows with. It covers what is behind, ours adds."""
_LEAST_GLOW = 1e-3
_HALF = 0.5
"""The part of all directions that a flat surface sees, of which their occlusion by rays and by depths is a part."""
_BACK = 10
"""How much stronger than the light from everywhere is a lamp that only brings it, from behind."""
_BLUE, _WHITE, _GREEN = (0x0000, 0x95A2, 0xFFFF), (0xFFFF, 0xFFFF, 0xFFFF), (0x0000, 0x2710, 0x01F4)


def look_of(settings: Settings, camera: dict[str, Any], look: Look, remarks: list[str]) -> dict[str, Any]:
    """All sections but those of the formula, the camera and the picture's size.

    Raises:
        FileError: a value is none of its kind.
    """
    main = settings.main
    screen = Screen.of(main)
    everywhere = _everywhere(main)
    lights = [*_main_light(main, camera, screen, everywhere), *_lamps(main, camera, screen)]
    ambient = _ambient(screen.amount(everywhere), lights, camera)
    material = _material(main, ambient, screen, remarks)
    around = environment_of(settings, screen.amount, remarks)
    found: dict[str, Any] = {
        "lights": lights,
        "material": material,
        "background": _background(main, camera, screen),
        "renderer": {"samples": 4},
    }
    if "f_number" in camera:
        found["renderer"]["samples"] = 16
    if material.get("reflection", 0) > 0:
        found["renderer"]["bounces"] = min(max(main.whole("reflections_max", 5), 0), 16)
    if _occlusion(main) > 0:
        found["renderer"]["ambient_occlusion"] = {"rays": 4, "distance": _seen_height(camera)}
    for key, section in (
        ("fog", _fog(main, screen, found["background"], around)),
        ("glow", _glow(main, camera, screen)),
        ("mist", mist_of(main, screen.color, _behind(found), remarks)),
        ("environment", around),
        ("objects", _limits(main)),
        ("output", _output(main, screen, remarks)),
    ):
        if section:
            found[key] = section
    on_surface = textures_of(main, "mat1_", look == "ours", remarks)
    if look == "ours":
        _lit_by_ours(found, settings, on_surface)
    return found


@dataclass(frozen=True, slots=True)
class Screen:
    """What becomes of their numbers on a screen: they are raised to 1/gamma."""

    gamma: float = 1.0

    @classmethod
    def of(cls, main: Section) -> Screen:
        return cls(min(max(main.number("gamma", 1.0), 0.2), 5.0))

    @property
    def power(self) -> float:
        """Of what may be above 1, about."""
        return _CURVE / self.gamma

    def amount(self, value: float) -> float:
        """An amount of light on their screen, which may be above 1, as one of ours."""
        return float(f"{min(max(value, 0.0) ** self.power, _LARGEST):.6g}")

    def color(self, color: Sequence[float]) -> list[float]:
        """A colour of theirs, 0 to 1, as linear light."""
        return decoded([min(max(part, 0.0), 1.0) ** (1 / self.gamma) for part in color])


def decoded(color: Sequence[float]) -> list[float]:
    """A colour of a screen, 0 to 1, as linear light: sRGB's curve."""
    return [
        round(each / 12.92 if each <= 0.04045 else ((each + 0.055) / 1.055) ** 2.4, 6)
        for each in (min(max(part, 0.0), 1.0) for part in color)
    ]


def _seen_height(camera: dict[str, Any]) -> float:
    """The height of the picture where the camera looks at, scene units: how far away occlusion is sought, about."""
    away = math.dist(camera["position"], camera["target"])
    height = 2 * away * math.tan(math.radians(camera["fov"] / 2))
    return float(f"{min(max(0.3 * height, 1e-9), _LARGEST):.4g}")


def _everywhere(main: Section) -> float:
    """Light that comes from all sides, on their screen."""
    # A flat surface has half of their occlusion's light, but for the kind that looks along the normal.
    seen = 1.0 if main.text("ambient_occlusion_mode").strip() in ("0", "fast") else _HALF
    return max(main.color("fill_light_color", (0, 0, 0))) + _occlusion(main) * seen


def _ambient(amount: float, lights: list[dict[str, Any]], camera: dict[str, Any]) -> float:
    """The material's part of each light that reaches everywhere, so that it is this amount in all.

    Without a directional light one is added: from behind, where no surface that the camera sees is lit by it.
    """
    if amount <= 0:
        return 0.0
    brightest = sum(light["intensity"] for light in lights if light.get("type") != "point")
    if brightest <= 0:
        _, forward, _ = _axes(camera)
        brightest = _BACK * amount
        direction = [round(-each, 9) + 0.0 for each in forward]
        lights.append({"direction": direction, "intensity": float(f"{brightest:.6g}")})
    return float(f"{amount / max(brightest, 0.05):.6g}")


def _main_light(
    main: Section, camera: dict[str, Any], screen: Screen, everywhere: float
) -> list[dict[str, Any]]:
    alpha, beta = (
        math.radians(main.number(f"main_light_{name}", default))
        for name, default in (("alpha", -45), ("beta", 45))
    )
    intensity = main.number("main_light_intensity", 1.0)
    color = main.color("main_light_colour", _WHITE)
    relative = main.flag("main_light_position_relative", True)
    shadow = main.flag("shadows_enabled", True)
    if not main.flag("main_light_enable", True) or intensity <= 0:
        return []
    # Where it comes from: alpha is the angle round, 0 behind the camera; beta the angle up.
    x, y, z = math.sin(alpha) * math.cos(beta), -math.cos(alpha) * math.cos(beta), math.sin(beta)
    if relative:
        right, forward, up = _axes(camera)
        x, y, z = (x * right[i] + y * forward[i] + z * up[i] for i in range(3))
    light: dict[str, Any] = {
        "direction": [round(-each, 9) + 0.0 for each in (x, y, z)],
        "color": screen.color(color),
        "intensity": screen.amount(_beside(intensity, everywhere, screen.power)),
    }
    if not shadow:
        light["shadow"] = False
    angle = main.number("shadows_cone_angle", 1.0)
    if main.flag("MC_soft_shadows_enable", False) and angle > 0:
        light |= {"angular_size": min(2 * angle, 170.0), "rays": 4}
    return [light]


def _beside(intensity: float, everywhere: float, power: float) -> float:
    """What to take for a light's intensity, so that with that from everywhere a surface is as bright as theirs."""
    added = (_FACING * intensity + everywhere) ** power - everywhere**power
    return float((added / _FACING) ** (1 / power))


def _lamps(main: Section, camera: dict[str, Any], screen: Screen) -> list[dict[str, Any]]:
    """Lamps at points. Light weakens with the square of the distance; on their screen it does so in code values."""
    found = []
    whole = main.number("aux_light_intensity", 1.0)
    defaults = ((1.3, (3, -3, 3)), (1.0, (-3, -3, 0)), (3.0, (-3, 3, -1)), (2.0, (0, -1, -3)))
    for name in ("main_light", *(f"aux_light_{number}" for number in range(1, _LAMPS + 1))):
        kind, _, ending = name.partition("light")
        if not main.flag(f"{kind}light_volumetric_enabled{ending}", False):
            main.without([f"{kind}light_volumetric_intensity{ending}"])
    main.without(main.beginning("aux_light_visibility", "main_light_visibility"))
    for number, (intensity, place) in zip(range(1, _LAMPS + 1), defaults, strict=True):
        strength = main.number(f"aux_light_intensity_{number}", intensity) * whole
        position = main.vector(f"aux_light_position_{number}", place)
        color = main.color(f"aux_light_colour_{number}", _WHITE)
        if not main.flag(f"aux_light_enabled_{number}", False) or strength <= 0:
            continue
        away = max(math.dist(position, camera["target"]), 1e-6)
        arriving = min(_LAMP_FACTOR * strength / away**2, 10.0)
        found.append(
            {
                "type": "point",
                "position": list(position),
                "falloff": "inverse_square",
                "color": screen.color(color),
                "intensity": float(f"{min(screen.amount(arriving) * away**2, _LARGEST):.6g}"),
            }
        )
    return found


def _axes(camera: dict[str, Any]) -> tuple[list[float], list[float], list[float]]:
    """Right, forward and up of the picture, each of length 1."""
    forward = _unit([a - b for a, b in zip(camera["target"], camera["position"], strict=True)])
    right = _unit(_cross(forward, camera["up"]))
    return right, forward, _cross(right, forward)


def _cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _unit(vector: Sequence[float]) -> list[float]:
    length = math.hypot(*vector)
    return [each / length for each in vector]


class _Surface:
    """The first material. Until version 2.08 its keys stood without `mat1_` before them, and one had another name."""

    def __init__(self, main: Section) -> None:
        self.main = main

    def key(self, name: str) -> str:
        new = f"mat1_{name}"
        if name == "reflectance" and new not in self.main.entries and "reflect" in self.main.entries:
            return "reflect"
        return name if new not in self.main.entries and name in self.main.entries else new


def _occlusion(main: Section) -> float:
    enabled = main.flag("ambient_occlusion_enabled", False)
    main.without(("ambient_occlusion_quality", "ambient_occlusion_mode", "ambient_occlusion_fast_tune"))
    return main.number("ambient_occlusion", 1.0) if enabled else 0.0


def _material(main: Section, ambient: float, screen: Screen, remarks: list[str]) -> dict[str, Any]:
    surface = _Surface(main)
    color = main.color(surface.key("surface_color"), (0xC350, 0xC350, 0xC350))
    specular = main.number(surface.key("specular"), 1.0)
    width = max(main.number(surface.key("specular_width"), 0.05), 1e-3)
    found: dict[str, Any] = {
        "color": screen.color(color),
        "ambient": ambient,
        "diffuse": 1,
        "specular": round(min(max(specular, 0.0), 1.0) * 0.5, 6),
        # Theirs is a power of the cosine with the half vector, which is about the fourth of Phong's exponent.
        "shininess": round(min(max(30 / width / 4, 1.0), 10_000.0), 6),
    }
    if not main.flag("raytraced_reflections", False):
        main.without((surface.key("reflectance"), "reflections_max"))
    else:
        found["reflection"] = round(min(max(main.number(surface.key("reflectance"), 0.0), 0.0), 1.0), 6)
    if main.number(surface.key("transparency_of_surface"), 0.0) > 0:
        remarks.append("mat1_transparency_of_surface: the surface is not made of glass")
    return found


def _background(main: Section, camera: dict[str, Any], screen: Screen) -> dict[str, Any]:
    """Their colours follow how far a ray points up; ours go from the top of the picture to its bottom."""
    first, second, third = (
        main.color(f"background_color_{number}", default)
        for number, default in ((1, _BLUE), (2, _WHITE), (3, _GREEN))
    )
    bright = main.number("background_brightness", 1.0)
    three = main.flag("background_3_colors_enable", True)

    def seen(up: float) -> list[float]:
        part, ends = (abs(up), (second, first if up >= 0 else third)) if three else (0.0, (first, first))
        return screen.color([bright * (a * (1 - part) + b * part) for a, b in zip(*ends, strict=True)])

    _, forward, top = _axes(camera)
    half = math.tan(math.radians(camera["fov"] / 2))
    above, below = (
        _unit([f + sign * half * t for f, t in zip(forward, top, strict=True)]) for sign in (1, -1)
    )
    return {"top": seen(above[2]), "bottom": seen(below[2])}


def _fog(
    main: Section, screen: Screen, background: dict[str, Any], around: dict[str, Any] | None
) -> dict[str, Any] | None:
    """Fog on the way to the surface, and to where they look no farther: what is behind it is mixed with its colour here.

    A picture behind it is there as it is, or not seen where more than half of it is fog.
    """
    color = main.color("basic_fog_color", (0xE807, 0xEF12, 0xFFFF))
    visibility = main.number("basic_fog_visibility", 20.0)
    if not main.flag("basic_fog_enabled", False) or visibility <= 0:
        return None
    through = math.exp(-max(main.number("view_distance_max", 50.0), 0.0) / visibility)
    own = screen.color(color)
    if around is not None and through < 0.5:
        around["background"] = False
    for side, seen in background.items():
        background[side] = [round(through * a + (1 - through) * b, 6) for a, b in zip(seen, own, strict=True)]
    return {"color": own, "density": float(f"{min(1 / visibility, _LARGEST):.6g}"), "background": False}


def _behind(found: dict[str, Any]) -> list[float]:
    """About what is seen through fog around the set, linear: what is behind the set, as that is in fog's own light."""
    return [sum(pair) / 2 for pair in zip(*found["background"].values(), strict=True)]


def _glow(main: Section, camera: dict[str, Any], screen: Screen) -> dict[str, Any] | None:
    """Theirs grows with the steps of a ray, up to its own colour and no further; ours with how near it passes.

    Where it is weak, as in most files, it is not seen in either.
    """
    outer = main.color("glow_color_2", (0xDF68, 0xEDD8, 0xF3C8))
    main.color("glow_color_1", (0xA018, 0xAEA9, 0xC152))
    intensity = main.number("glow_intensity", 0.2)
    if not main.flag("glow_enabled", True) or intensity <= 0:
        return None
    amount = screen.amount(min(intensity * _STEPS / 512, 0.3))
    if amount < _LEAST_GLOW:
        return None
    return {"color": screen.color(outer), "intensity": amount, "width": 0.2 * _seen_height(camera)}


def _limits(main: Section) -> dict[str, Any] | None:
    """A box that the set is cut to."""
    low, high = main.vector("limit_min", (-10, -10, -10)), main.vector("limit_max", (10, 10, 10))
    if not main.flag("limits_enabled", False) or any(a >= b for a, b in zip(low, high, strict=True)):
        return None
    return {
        "limits": {
            "type": "box",
            "position": [(a + b) / 2 for a, b in zip(low, high, strict=True)],
            "size": [b - a for a, b in zip(low, high, strict=True)],
            "join": "intersection",
        }
    }


def _output(main: Section, screen: Screen, remarks: list[str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    bright = main.number("brightness", 1.0)
    if bright > 0 and bright != 1:
        found["exposure"] = round(min(max(math.log2(bright) * screen.power, -20), 20), 6)
    if main.flag("hdr", False):
        found["tone"] = "reinhard"
    for key in ("contrast", "saturation"):
        if abs(main.number(key, 1.0) - 1) > 0.05:
            remarks.append(f"{key}: {main.number(key, 1.0):g} is not taken over")
    return found


def _lit_by_ours(found: dict[str, Any], settings: Settings, on_surface: dict[str, Any]) -> None:
    """Light along paths, of the sun and a sky or the picture behind the set, in place of theirs."""
    found["lighting"] = {"mode": "path", "bounces": 6}
    found["lights"] = [
        {**light, "angular_size": 3} if light.get("type") != "point" else light for light in found["lights"]
    ]
    if "environment" in found:
        del found["environment"]["rays"]
    else:
        found["environment"] = {"name": "overcast", "background": False, **lying_there(settings)}
    found["material"] |= {"ambient": 0, "diffuse": 1, "specular": 0, "reflection": 0}
    found["renderer"] = {"samples": 64}
    found["output"] = {**found.get("output", {}), "tone": "agx"}
    found.pop("glow", None)
    found.pop("mist", None)
    if on_surface:
        found["materials"] = {SURFACE: {"specular": {"roughness": 0.3}, **on_surface}}
        found["material"]["name"] = SURFACE
