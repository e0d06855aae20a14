"""Formulas that use all later words of the language: the application's number, carried numbers, statements, vectors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clfractal.formulas import catalog
from clfractal.formulas.chain import Chain
from clfractal.formulas.opencl import write_formula

Floats = NDArray[np.float64]

XYZ: dict[str, Any] = {"variables": ["x", "y", "z"], "bounds": {"radius": 2}}

_COMMON: dict[str, Any] = {"degree": 2, "bounds": {"radius": 1.5}, "bailout": 4}

NUMBERED: dict[str, Any] = {
    **_COMMON,
    "variables": ["x", "y", "z"],
    "parameters": {"first": {"type": "int", "default": 1}, "last": {"type": "int", "default": 3}},
    "let": {"turn": "where(n >= first and n < last, 0.4, mod(n, 2))"},
    "map": ["x*x - y*y - z*z + 0.1*n", "2*x*y + turn*z", "2*x*z - turn*y"],
}

# `scale` has no slope, `hue` has one, on `size` and `near` z does not depend.
CARRIED: dict[str, Any] = {
    **_COMMON,
    "variables": ["x", "y", "z"],
    "parameters": {"s": 0.8},
    "state": {
        "scale": {"start": "s", "next": "0.9*scale + 0.01*n"},
        "size": {"start": 1, "next": "2*sqrt(x*x + y*y + z*z)*size + 1"},
        "hue": {"start": "x", "next": "0.5*hue + abs(y)"},
        "near": {"start": 1e3, "next": "min(near, abs(x))"},
    },
    "let": {"t": "0.1*hue"},
    "map": ["scale*(x*x - y*y - z*z) + t", "2*x*y*scale", "2*x*z - t*y"],
    "distance": "0.5*sqrt(x*x + y*y + z*z)*log(sqrt(x*x + y*y + z*z))/size",
}

# Conditions of parameters, of the number, and of z, one in the other; names that get values again and again.
STATEMENTS: dict[str, Any] = {
    **_COMMON,
    "variables": ["x", "y", "z"],
    "parameters": {"on": 1, "off": 0, "at": {"type": "int", "default": 1}, "p": 2.5},
    "state": {"count": 0, "size": "1 + off"},
    "do": [
        {"x": "x*1.1", "size": "2*size"},
        {"when": "on > 0.5", "do": [{"y": "y + 0.1*x"}, {"u": "x*y"}], "else": [{"u": "z"}, {"y": "2*y"}]},
        {"when": "off > 0.5", "do": [{"x": "1/off + x"}]},
        {
            "when": "n >= at",
            "do": [
                {"v": "0.3*x"},
                {"when": "x > y", "do": [{"x": "y", "y": "x"}], "else": [{"x": "x - 0.01", "v": "v + 1"}]},
                {"z": "z + 0.05*v"},
                {"count": "count + 1"},
            ],
        },
        {
            "when": "z < 0 or u > 0.2",
            "do": [{"z": "-z"}, {"w": "sin(x) + cos(y)*exp(-x*x)"}, {"x": "x + 0.1*w"}],
            "else": [{"x": "x*0.9"}],
        },
        {"r": "sqrt(x*x + y*y)"},
        {"a": "cpow_re(r, z, p)", "b": "cpow_im(r, z, p)"},
        {"x": "a*x/max(r, 0.1) + 0.1*count", "y": "a*y/max(r, 0.1)", "z": "b + size*0.01"},
    ],
}

# Loops: of parameters, with numbers that have a slope after a turn, left by some lanes or by all, within each other.
LOOPS: dict[str, Any] = {
    **_COMMON,
    "variables": ["x", "y", "z"],
    "parameters": {"turns": {"type": "int", "default": 3, "minimum": 0, "maximum": 12}, "c": 0.3},
    "do": [
        {"sum": 0, "flat": 1},
        {
            "loop": "turns",
            "as": "i",
            "do": [{"sum": "sum + x/(i + 1)", "flat": "flat*c + i"}, {"x": "y", "y": "0.9*x"}],
        },
        {"loop": 20, "until": "x*x + y*y > 0.5", "do": [{"x": "x*1.2 + 0.01", "y": "y*1.2"}]},
        {"loop": "turns + 1", "most": 9, "as": "j", "until": "j > n", "do": [{"z": "z + 0.02*j*flat"}]},
        {
            "loop": 3,
            "as": "k",
            "do": [
                {
                    "loop": "turns",
                    "do": [{"when": "k == 1", "do": [{"z": "z*0.9"}], "else": [{"z": "z + 0.01"}]}],
                }
            ],
        },
        {"x": "x*x - y*y + 0.1*sum", "y": "2*x*y", "z": "z*x"},
    ],
}

VECTORS: dict[str, Any] = {
    **_COMMON,
    "variables": {"v": 3},
    "parameters": {"a": 0.3, "b": -0.5, "c": 1.1, "limit": 0.9},
    "functions": {
        "folded(p, l)": "clamp(p, -l, l)*2 - p",
        "ball(p)": {"let": {"r2": "dot(p, p)"}, "value": "p/clamp(r2, 0.25, 1)"},
    },
    "state": {"trap": "vec(1, 1, 1)"},
    "do": [
        {"v": "rotate(v, vec(a, b, c))"},
        {"v": "folded(v, limit)"},
        {"v.xy": "rotate(v.xy, a)", "trap": "min(trap, abs(v))"},
        {"v": "ball(v) + 0.1*cross(v, vec(a, b, c))"},
        {"v": "rotate(v, vec(1, v.x, 0.5), b)"},
        {"v": "reflect(v, vec(1, b, 0.2)) + 0.05*normalize(v)*length(v.yz)"},
        {"when": "v.z > 0.2", "do": [{"v.z": "0.4 - v.z"}]},
        {"v": "1.2*v + 0.1*trap + vec(cpow(v.xy, 2), fold(v.z, 0.5)) + 0.1*point.zxy"},
    ],
}

QUATERNIONS: dict[str, Any] = {
    **_COMMON,
    "variables": {"q": 4},
    "parameters": {"w": 0.2},
    "slice": {"w": "w*q.x"},
    "map": "qmul(q, qmul(q, q)) + vec(cmul(q.xy, q.zw), 0, 0)",
    "degree": 3,
}

GROWN: dict[str, Any] = {
    "numbered": {"inline": NUMBERED},
    "carried": {"inline": CARRIED},
    "carried, Julia": {"inline": CARRIED, "julia": [0.1, -0.3, 0.2]},
    "statements": {"inline": STATEMENTS},
    "statements, other values": {"inline": STATEMENTS, "parameters": {"on": 0, "off": 0.7, "at": 2, "p": 2}},
    "loops": {"inline": LOOPS},
    "loops, other values": {"inline": LOOPS, "parameters": {"turns": 5, "c": -0.4}},
    "vectors": {"inline": VECTORS},
    "quaternions": {"inline": QUATERNIONS},
    "a chain": {
        "chain": [
            {"inline": STATEMENTS, "count": 2, "stop": 3},
            {"inline": CARRIED, "start": 1},
            {"name": "hast"},
        ]
    },
}


def chain_of(formula: dict[str, Any], **spec: Any) -> Chain:
    return catalog.load_chain({"inline": formula, **spec})


def text_of(formula: dict[str, Any], **spec: Any) -> str:
    return write_formula(chain_of(formula, **spec)).text


def function(text: str, name: str) -> str:
    """The body of a function of a text."""
    return text.partition(f" {name}(")[2].partition("\n}")[0]


def ball(size: float, count: int = 300, seed: int = 1) -> Floats:
    """Points within a ball, most of them not near its middle."""
    rng = np.random.default_rng(seed)
    arm = rng.normal(size=(count, 3))
    arm *= size * rng.uniform(0.2, 1, (count, 1)) / np.linalg.norm(arm, axis=1, keepdims=True)
    return arm.astype(np.float32).astype(np.float64)
