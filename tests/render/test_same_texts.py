"""Texts of programs are the same in every process, or each would compile them once more."""

from __future__ import annotations

import subprocess
import sys

from tests.shell import environment

CODE = """
import hashlib
from clfractal.formulas import catalog
from clfractal.integrators.plan import make_plan
from clfractal.integrators.surface import program_texts
from clfractal.scene.load import load_scene
for name in catalog.names():
    julia = {"julia": [0.1, 0.2, 0.3, 0.4]} if name == "quaternion_julia" else {}
    scene = load_scene({"version": 1, "formula": {"name": name, **julia}, "camera": {}})
    for precision in ("float32", "float64"):
        for text in program_texts(scene, make_plan(scene, precision=precision, lanes=8)):
            print(name, precision, hashlib.sha256(text.flat.text.encode()).hexdigest())
"""


def test_it_does_not_depend_on_the_order_of_sets() -> None:
    """Python's hashes of texts, and with them the order of a set, differ from process to process."""
    told = []
    for seed in range(4):
        settings = environment({"PYTHONHASHSEED": str(seed)})
        ended = subprocess.run(
            [sys.executable, "-P", "-c", CODE], env=settings, capture_output=True, text=True, check=True
        )
        told.append(ended.stdout)
    assert len(told[0].splitlines()) >= 20
    assert set(told) == {told[0]}
