"""What scenes may have, feature by feature, for tests that let every pair of them meet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Values = Mapping[str, Mapping[str, Any]]
"""What a scene says for each value of a feature: sections that are put together."""

# One of each kind: a scalar rule, the Jacobian (by partials, and operation by operation), a shape, a chain, states
# of four numbers by both rules, folds with an inversion, and the one that needs the most registers.
FORMULAS = (
    "mandelbulb",
    "hast",
    "aexion",
    "sierpinski_tetrahedron",
    "mengerbulb",
    "quaternion_julia",
    "box_fold_quaternion",
    "kaliset",
    "riemann_sphere",
)
_TILTED = {"normal": [1, -1, 0.2], "width": 2, "height": 2}
_OFTEN: Mapping[str, Values] = {
    "planes": {
        "": {},
        "planes": {"cut_planes": [{"plane": _TILTED, "count": 2}]},
        "cut": {"cut_planes": [{"plane": _TILTED, "cut": True}]},
    },
    "lens": {"": {}, "lens": {"camera": {"f_number": 0.5}}},
    "noise": {"": {}, "noise": {"renderer": {"noise": 0.01, "samples": 64}}},
    "motion": {"": {}, "motion": {"animation": {"frames": 2, "shutter": 0.5, "frame": 0}}},
}
_SHAPES = [
    {"type": "sphere", "position": [9, 0, 9], "radius": 1},
    {"type": "rectangle", "position": [-9, 0, 9], "direction": [1, 0, -1], "width": 2, "height": 1},
    {"type": "spot", "position": [0, -9, 9], "direction": [0, 1, -1]},
]
_GLASS = {
    "lighting": {"mode": "path"},
    "materials": {
        "glass": {"transmission": {"weight": 1, "dispersion_scale": 1}, "thin_film": {"weight": 1}}
    },
    "material": {"name": "glass"},
}
_SKIN = {
    "lighting": {"mode": "path"},
    "materials": {"skin": {"subsurface": {"weight": 0.8}}},
    "material": {"name": "skin"},
}
_MAPS = {
    "lighting": {"mode": "path"},
    "materials": {
        "gold": {
            "base": {"color": {"by": "trap", "palette": ["#fff", "#840"]}, "metalness": 1},
            "specular": {"roughness": {"by": "iterations", "curve": [[0, 0.1], [1, 0.6]]}},
        },
        "clay": {"base": {"weight": {"by": "curvature"}}, "bump": {"height": {"by": "trap"}}},
        "both": {"blend": ["gold", "clay"], "mask": {"by": "normal"}},
    },
    "material": {"name": "both"},
}
_EMBERS = {"emission": {"luminance": 4}}
_OBJECTS = {
    "sea": {"type": "water", "position": [0, 0, -3], "material": "wood"},
    "ball": {"type": "sphere", "position": [3, 0, 0], "radius": 1, "material": "wood"},
}
_LAMPS = {
    "ball": {"type": "sphere", "position": [3, 0, 0], "material": "glow"},
    "box": {"type": "box", "position": [0, 3, 0], "material": "glow"},
    "tube": {"type": "cylinder", "position": [0, 0, 3], "material": "glow"},
}
_GRIDS = {
    "core": {"type": "volume", "file": "ball.npy", "position": [3, 0, 0], "material": "wood"},
}
_CLOUDS = {
    **_GRIDS,
    "cloud": {
        "type": "volume",
        "file": "ball.npy",
        "transfer": {
            "opacity": [{"at": 0, "opacity": 0}, {"at": 255, "opacity": 0.5}],
            "emission": [{"at": 0, "emission": [0.1, 0, 0]}],
        },
    },
}
_JOINED: dict[str, dict[str, Any]] = {
    "hole": {"type": "sphere", "join": "cut"},
    "drop": {"type": "box", "position": [1, 0, 0], "join": "smooth_union"},
    "other": {"type": "formula", "formula": {"name": "hast"}, "position": [3, 0, 0], "material": "embers"},
    "mould": {"type": "formula", "formula": {"name": "hast"}, "position": [0, -1, 0], "join": "cut"},
}
# Of features whose code is a part of another one's only the other is here: a sky has a map, shafts of light have fog, lamps
# with a shape are soft. Each program takes several compilers.
SURFACE: Mapping[str, Values] = {
    "formula": {name: {"formula": {"name": name}} for name in FORMULAS},
    "coloring": {
        "solid": {},
        "normal": {"coloring": {"by": "normal"}},
        "iterations": {"coloring": {"by": "iterations"}},
        "residual": {"coloring": {"by": "residual"}},
        "thickness": {"coloring": {"by": "thickness", "along": "view"}},
        "layer": {"coloring": {"by": "layer_distance", "along": "reflection"}},
        "trap": {"coloring": {"by": "trap", "trap": {"shape": "sphere"}}},
    },
    "points": {
        "": {},
        "grid": {"renderer": {"points": {"count": 9}}},
        "triangle": {"renderer": {"normal": "one_triangle"}},
        "shading": {"renderer": {"normal": "eight_triangles_shading"}},
        "eight": {"renderer": {"normal": "eight_triangles_normal"}},
        "squares": {"renderer": {"points": {"pattern": "stochastic", "count": 4}, "normal": "least_squares"}},
    },
    "lighting": {
        "": {},
        "path": {"lighting": {"mode": "path"}},
        "glass": _GLASS,
        "skin": _SKIN,
        "maps": _MAPS,
    },
    "objects": {
        "": {},
        "objects": {"objects": _OBJECTS, "materials": {"wood": {}}},
        "joined": {"objects": _JOINED, "materials": {"embers": _EMBERS}},
        # A part of the set that is a body for itself along paths.
        "pane": {
            "objects": {"other": {**_JOINED["other"], "material": "pane"}, "mould": _JOINED["mould"]},
            "materials": {"pane": {"transmission": {"weight": 1}}},
        },
        # Beside them objects that shine.
        "grids": {
            "objects": {**_GRIDS, **_LAMPS},
            "materials": {"wood": {}, "glow": {"emission": {"luminance": 5}}},
        },
        "clouds": {"objects": _CLOUDS, "materials": {"wood": {}}},
        "opened": {
            "objects": _OBJECTS,
            "materials": {"wood": {}},
            "cut_planes": [{"plane": _TILTED, "cut": True, "set": False, "objects": ["ball"]}],
        },
    },
    "search": {"": {}, "steps": {"renderer": {"search": "steps"}}},
    "occlusion": {"": {}, "occlusion": {"renderer": {"ambient_occlusion": {"rays": 2}}}},
    "environment": {
        "": {},
        "sky": {"environment": {"sky": {}, "rays": 2}},
    },
    "light": {
        "": {},
        "shapes": {"lights": _SHAPES},
    },
    "fog": {
        "": {},
        "shafts": {"fog": {"density": 0.05, "height": 2, "scattering": {}}},
        "glow": {"glow": {"by": "trap"}, "mist": {"by": "iterations"}},
    },
    **_OFTEN,
}
_STOPS = [{"at": 0.05, "opacity": 0}, {"at": 1, "opacity": 0.6}]
_SHINES = [{"at": 0, "emission": [0, 0, 0]}, {"at": 1, "emission": [1, 0.5, 0]}]
_TINTS = [{"at": 0, "color": [1, 0, 0]}, {"at": 1, "color": [0, 0, 1]}]
VOLUME: Mapping[str, Values] = {
    "formula": {name: {"formula": {"name": name}} for name in ("mandelbulb", "hast")},
    "transfer": {
        "level": {},
        "opacity": {"renderer": {"transfer": {"opacity": _STOPS}}},
        "shining": {"renderer": {"transfer": {"opacity": _STOPS, "emission": _SHINES}}},
        "tinted": {"renderer": {"transfer": {"opacity": _STOPS, "color": _TINTS}}},
    },
    "lighting": {"": {}, "path": {"lighting": {"mode": "path"}}},
    "shadows": {"": {}, "shadows": {"renderer": {"shadows": True}}},
    "places": {"": {}, "nearest": {"renderer": {"interpolation": "nearest"}}},
    "coloring": {"solid": {}, "normal": {"coloring": {"by": "normal"}}},
    **_OFTEN,
}
CUT_PLANE: Mapping[str, Values] = {
    "formula": {name: {"formula": {"name": name}} for name in FORMULAS},
    "counts": {"smooth": {}, "stepped": {"renderer": {"colors": {"mode": "stepped"}}}},
    "noise": _OFTEN["noise"],
    "motion": _OFTEN["motion"],
}
APART = {
    frozenset({("coloring", "residual"), ("points", "")}),  # a plane needs points
    # Each sample of a path finds a spot of its own.
    *(
        frozenset({("lighting", light), ("points", name)})
        for light in ("path", "glass", "skin", "maps")
        for name in SURFACE["points"]
        if name
    ),
    *(
        frozenset({("lighting", light), ("coloring", "residual")})
        for light in ("path", "glass", "skin", "maps")
    ),
    *(frozenset({("lighting", light), ("planes", "cut")}) for light in ("glass", "skin")),
    # These have planes of their own.
    *(frozenset({("objects", "opened"), ("planes", name)}) for name in ("planes", "cut")),
    *(
        frozenset({("objects", own), ("planes", name)})
        for own in ("joined", "pane")
        for name in ("planes", "cut")
    ),
    frozenset({("objects", "joined"), ("lighting", "glass")}),
    frozenset({("objects", "clouds"), ("lighting", "")}),
    # So they have neither points nor a plane through them.
    frozenset({("objects", "clouds"), ("coloring", "residual")}),
    *(frozenset({("objects", "clouds"), ("points", name)}) for name in SURFACE["points"] if name),
    frozenset({("objects", "clouds"), ("fog", "shafts")}),
}
OF_MEDIA = {
    frozenset({("lighting", "path"), ("transfer", "level")}),
    *(frozenset({("lighting", "path"), ("planes", name)}) for name in ("planes", "cut")),
}
FEATURES: Mapping[str, Mapping[str, Values]] = {"surface": SURFACE, "volume": VOLUME, "cut_plane": CUT_PLANE}


def put_together(
    scene: dict[str, Any], features: Mapping[str, Values], chosen: Mapping[str, str]
) -> dict[str, Any]:
    """A scene with what is chosen of each feature."""
    whole = dict(scene)
    for feature, value in chosen.items():
        for section, content in features.get(feature, {}).get(value, {}).items():
            known = whole.get(section)
            whole[section] = {**known, **content} if isinstance(known, dict) else content
    return whole
