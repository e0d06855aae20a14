"""Trial marches: two small pictures whose rays a device marches as those of scenes, and the time of it.

The rays are made here, since only their march is measured. They go through the queue of all renderers' rays
(`queue.h`), in which lanes that are done take the next one: packets that wait for their last ray would tell
another lane count.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device import program
from clfractal.device.groups import fitting
from clfractal.device.select import Device
from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Precision
from clfractal.formulas.catalog import load_chain
from clfractal.formulas.language import Chain
from clfractal.formulas.opencl import FormulaText, write_formula
from clfractal.geometry.fineness import NEAR
from clfractal.integrators.declarations import struct_text
from clfractal.integrators.kernel import MET_NUMBERS, STATE_PADDING
from clfractal.integrators.march import MARCH, SHADOW_DETAIL, SHADOW_LIFT
from clfractal.integrators.records import orbit_record
from clfractal.integrators.waves import GOAL_SHADOW, GOAL_SURFACE, rays_group, rays_of_item
from clfractal.scene.surface import SurfaceRenderer

Rule = Literal["scalar", "jacobian"]
RULES: tuple[Rule, ...] = ("scalar", "jacobian")

# The pictures' sides: enough rays for a GPU; on a processor so many that the last rays of each share, which leave lanes
# empty, are few, and launches of some milliseconds, many of which no other program interrupts.
_SIDES: dict[Rule, int] = {"scalar": 256, "jacobian": 160}
_SIDE_GPU = 1024
_RAYS_OF_CORE = 2048
# Of a turn, see `rounds.py`.
_LAUNCHES, _SECONDS = 25, 0.03
# Places in the queue's structs.
_HIT, _T = 0, 3

Numbers = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Example:
    """What is marched: formula, iterations, the eye, where it looks, and the direction to the light."""

    formula: str
    parameters: Mapping[str, float]
    iterations: int
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    light: tuple[float, float, float]


# Views of the speed table (`clfractal bench`).
_EXAMPLES: dict[Rule, _Example] = {
    "scalar": _Example("mandelbulb", {"power": 8}, 100, (0, -3, 0), (0, 0, 0), (-0.5, -0.6, 0.62)),
    "jacobian": _Example("hast", {"power": 2}, 40, (-0.8, 2.2, 3.0), (-0.5, 0, 0), (0.4, 0.5, 0.77)),
}


@dataclass(frozen=True, slots=True)
class _Rays:
    """Rays of a queue: origins and directions, shape (count, 3), and of each its length and its cone; scene units."""

    origins: Numbers
    directions: Numbers
    footprints: Numbers
    spreads: Numbers

    def numbers(self, chain: Chain) -> Numbers:
        """As the queue has them, shape (12, count), within the set's sphere; beyond it far is less than near."""
        offset = self.origins - np.array(chain.center)
        middle = -(offset * self.directions).sum(1)
        nearest = offset + middle[:, None] * self.directions
        half_chord = np.sqrt(np.maximum(chain.radius**2 - (nearest**2).sum(1), 0.0))
        near = np.maximum(middle - half_chord, 0.0)
        far = np.where(half_chord > 0, middle + half_chord, -1.0)
        # Nothing is known of other rays, and no cone has gone before these.
        widths = [self.footprints, self.spreads]
        return np.vstack([self.origins.T, self.directions.T, near, far, *widths, np.zeros_like(near), near])


def picture_side(device: Device, rule: Rule) -> int:
    """Side in pixels of the picture that tells a device's speed by a rule."""
    if device.info.kind == "gpu":
        return _SIDE_GPU
    wanted = math.sqrt(_RAYS_OF_CORE * max(device.info.compute_units, 1))
    return max(_SIDES[rule], 8 * math.ceil(wanted / 8))


def program_text(formula: FormulaText, lanes: int, precision: Precision) -> FlatText:
    """The whole text of the program that marches for a measurement."""
    defines = {"LANES": lanes, "REAL_IS_DOUBLE": int(precision == "float64")}
    generated = {"structs.h": struct_text(), "formula.h": formula.text}
    return flatten("integrators/march/march_probe.cl", generated=generated, defines=defines)


class Marcher:
    """A picture of `side` x `side` pixels, a multiple of 8, and a shadow ray from each hit: marched as often as wanted.

    Both were marched once when it is made, so a driver has compiled all.

    Raises:
        DeviceError, KernelBuildError: the device failed.
    """

    def __init__(self, device: Device, precision: Precision, lanes: int, rule: Rule, side: int) -> None:
        example = _EXAMPLES[rule]
        chain = load_chain(example.formula, example.parameters)
        self._side = side
        self._trial = _Trial(device, precision, lanes, chain, example.iterations)
        eye_rays = _eye_rays(example, side)
        self._eye = self._trial.launch(eye_rays, GOAL_SURFACE)
        met = self._eye.met()
        self._hit, self._t = met[_HIT] > 0.5, met[_T]
        hit, t = self._hit, self._t
        toward = np.array(example.light) / np.linalg.norm(example.light)
        cone = eye_rays.spreads * t
        points = eye_rays.origins + t[:, None] * eye_rays.directions
        lift = SHADOW_LIFT * SurfaceRenderer.model_validate({}).detail
        shadow_rays = _Rays(
            (points + (cone * lift)[:, None] * toward)[hit],
            np.broadcast_to(toward, points[hit].shape),
            (cone * SHADOW_DETAIL)[hit],
            np.zeros(int(hit.sum())),
        )
        self._shadow = self._trial.launch(shadow_rays, GOAL_SHADOW)

    def milliseconds(self) -> float:
        """Of the fastest of some launches of either kind."""
        return max(self._eye.milliseconds() + self._shadow.milliseconds(), 1e-3)

    def picture(self) -> npt.NDArray[np.float32]:
        """For each pixel, shape (side, side, 2): how far its ray went (-1 where it met nothing), and whether the light is
        hidden there."""
        side, hit = self._side, self._hit
        result = np.zeros((side * side, 2), np.float32)
        result[:, 0] = np.where(hit, self._t, -1.0)
        result[hit, 1] = self._shadow.met()[_HIT] > 0.5
        picture = np.empty_like(result)
        picture[_block_order(side)] = result
        return picture.reshape(side, side, 2)


class _Trial:
    """A program that marches rays of one formula, with what it reads."""

    def __init__(
        self, device: Device, precision: Precision, lanes: int, chain: Chain, iterations: int
    ) -> None:
        self.device, self.precision, self.lanes, self.chain = device, precision, lanes, chain
        formula = write_formula(chain)
        flat = program_text(formula, lanes, precision)
        flags = program.math_flags(precision)
        built = program.build(
            device, flat.text, flags=flags, sources=flat.sources, isolated=False, keep=False
        )
        self.kernel = built.kernel("march_probe")
        self.scene = [
            self._upload(array)
            for array in (
                _settings(chain, precision).reshape(1),
                orbit_record(chain, iterations, precision).reshape(1),
                np.array(formula.constants or [0.0], precision),
            )
        ]

    def _upload(self, array: npt.NDArray[Any]) -> cl.Buffer:
        buffer = self.device.buffer(array.nbytes, "the measured scene")
        cl.enqueue_copy(self.device.queue, buffer, np.ascontiguousarray(array).view(np.uint8).reshape(-1))
        return buffer

    def launch(self, rays: _Rays, goal: int) -> _Launch:
        """What marches these rays; it has done so once."""
        numbers = rays.numbers(self.chain)
        count = numbers.shape[1]
        stride = count + STATE_PADDING
        queue = np.zeros((len(numbers), stride), self.precision)
        queue[:, :count] = numbers
        found = np.zeros((MET_NUMBERS, stride), self.precision)
        share = rays_of_item(self.lanes, count, self.device.info.compute_units)
        group = fitting(self.device, self.kernel, rays_group(self.lanes))
        arguments = (
            self._upload(queue),
            self._upload(found),
            *self.scene,
            *(np.int32(each) for each in (count, stride, share, goal)),
        )
        size = (-(-count // (group[0] * share)) * group[0],)
        return _Launch(self, arguments, count, size, group)


class _Launch:
    """Rays on the device, and the launch that marches them."""

    def __init__(
        self,
        trial: _Trial,
        arguments: tuple[Any, ...],
        count: int,
        size: tuple[int, ...],
        group: tuple[int, ...],
    ) -> None:
        self._trial, self._arguments, self._count = trial, arguments, count
        self._size, self._group = size, group
        self._once()

    def _once(self) -> float:
        """Marches the rays; milliseconds of the device."""
        trial = self._trial
        with trial.device.failures("marching"):
            trial.kernel.set_args(*self._arguments)
            event = cl.enqueue_nd_range_kernel(trial.device.queue, trial.kernel, self._size, self._group)
            event.wait()
            return 1e-6 * float(event.profile.end - event.profile.start)

    def milliseconds(self) -> float:
        """Of the fastest of some launches."""
        times = [self._once()]
        while len(times) < _LAUNCHES and sum(times) < 1e3 * _SECONDS:
            times.append(self._once())
        return min(times)

    def met(self) -> Numbers:
        """What the rays have met, shape (13, count)."""
        found = np.empty((MET_NUMBERS, self._count + STATE_PADDING), self._trial.precision)
        with self._trial.device.failures("marching"):
            cl.enqueue_copy(self._trial.device.queue, found, self._arguments[1])
        return found[:, : self._count].astype(np.float64)


def _settings(chain: Chain, precision: Precision) -> npt.NDArray[np.void]:
    """The march of a usual scene; what it does not read stays 0."""
    usual = SurfaceRenderer.model_validate({})
    values: dict[str, object] = {
        "bounds_center": chain.center,
        "bounds_radius": chain.radius,
        "set_radius": chain.radius,
        "step_scale": chain.step_scale,
        "relaxation": usual.over_relaxation,
        "detail": usual.detail,
        "near": NEAR * chain.step_scale,
        "max_steps": usual.max_steps,
    }
    unused = {field.name: np.zeros(field.count) if field.count else 0 for field in MARCH.fields}
    return MARCH.value(precision, {**unused, **values})


def _block_order(side: int) -> npt.NDArray[np.int64]:
    """The pixels' numbers, counted row by row, in the order of rays: blocks of 8 x 8, in them blocks of 4 x 4, of 2 x 2."""
    numbers = np.arange(side * side).reshape(side // 8, 2, 2, 2, side // 8, 2, 2, 2)
    return numbers.transpose(0, 4, 1, 5, 2, 6, 3, 7).reshape(-1)


def _eye_rays(example: _Example, side: int) -> _Rays:
    """Of all pixels; the field of view is 53 degrees."""
    eye = np.array(example.eye, float)
    axis = np.array(example.target) - eye
    axis /= np.linalg.norm(axis)
    right = np.cross(axis, [0.0, 0.0, 1.0])
    right *= 1.0 / (side * np.linalg.norm(right))
    rows, columns = np.divmod(_block_order(side), side)
    across, below = (columns + 0.5 - 0.5 * side)[:, None], (rows + 0.5 - 0.5 * side)[:, None]
    on_plane = axis + across * right + below * np.cross(axis, right)
    lengths = np.linalg.norm(on_plane, axis=1)
    spreads = np.linalg.norm(right) / lengths
    return _Rays(
        np.broadcast_to(eye, on_plane.shape), on_plane / lengths[:, None], np.zeros(side * side), spreads
    )
