"""Isosurfaces of grids: marching cubes brick by brick, joined without seams.

Each brick goes through scikit-image's marching cubes (Lewiner, Lopes, Vieira, Tavares: "Efficient
implementation of Marching Cubes' cases with topological guarantees", 2003), which here only decides which
edges of the grid are joined to triangles. Where a vertex lies on its edge is computed from the two samples
at its ends, and an edge has one key in the whole grid: so bricks share the very same vertices.

A whole surface needs two cells to agree about the face between them. Where two corners across are inside and
the other two outside, the sign of A C - B D decides, and scikit-image leaves it to chance if that is below
1.2e-7 (as of every such face of a grid of 0 and 1), which tears holes. So it is given other numbers in the
place of differences d to the level: sign(d) 2^30 |d|^(1/32), and inside a little more, which decides nearly
as d does and never ties. Their ratio stays below 2^8, so that a vertex tells its edge by its place, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.files.mesh import Mesh

Values = npt.NDArray[Any]
Doubles = npt.NDArray[np.float64]
Keys = npt.NDArray[np.int64]
Cells = tuple[int, int, int]

BRICK = 96
"""Cells along the side of a brick: below 20 MB of arrays while it is worked on."""

# A vertex keeps this far from the ends of its edge, in its length: no triangle is ever without an area.
_FROM_END = 1 / 1024
_LARGEST, _LEAST = 1e38, 1e-38
_TALL = np.float32(2.0**30)
_INSIDE_MORE = np.float32(1 + 2.0**-20)
_CENTER = 3  # in the place of an axis: a vertex in the middle of a cell


def extract(
    values: Values,
    level: float,
    *,
    origin: npt.ArrayLike = (0.0, 0.0, 0.0),
    directions: npt.ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    close: bool = True,
    brick: int = BRICK,
    progress: Callable[[float], None] | None = None,
) -> Mesh:
    """The surface between values below `level` (outside) and the others; NaN is outside.

    Args:
        values: shape (nz, ny, nx), or what gives such arrays when it is indexed by three slices.
        origin: the middle of the first voxel, scene units.
        directions: (3, 3), row i the step to the next voxel along x, y, z.
        close: whether what lies beyond the grid counts as outside: the surface is closed, flat half a voxel beyond
            the last one. Otherwise it ends at the outermost voxels.
        brick: cells along the side of a brick.
        progress: called with the finished fraction, 0 to 1, after each brick.

    Returns:
        A mesh in scene units: triangles counter-clockwise seen from outside, normals by the values' gradient. It has no
        triangle if no two neighbours differ.
    """
    job = _Extraction(
        values,
        float(level),
        1 if close else 0,
        np.asarray(origin, np.float64),
        np.asarray(directions, np.float64),
    )
    sides = job.cells
    starts = [range(0, side, brick) for side in sides]
    count = int(np.prod([len(start) for start in starts])) or 1
    for done, place in enumerate(product(*starts), start=1):
        job.add((place[0], place[1], place[2]), brick)
        if progress is not None:
            progress(done / count)
    return job.mesh()


@dataclass(frozen=True, slots=True)
class _Face:
    """The vertices on a face between two bricks: sorted keys, and their numbers in the mesh."""

    keys: Keys
    numbers: Keys


@dataclass(slots=True)
class _Extraction:
    """What has been found so far. Coordinates are (z, y, x) of samples, those of `padding` included."""

    values: Values
    level: float
    padding: int
    origin: Doubles
    directions: Doubles
    count: int = 0
    points: list[npt.NDArray[np.float64]] = field(default_factory=list)
    normals: list[npt.NDArray[np.float32]] = field(default_factory=list)
    triangles: list[npt.NDArray[np.int32]] = field(default_factory=list)
    faces: dict[tuple[int, int, int, int], _Face] = field(default_factory=dict)

    @property
    def samples(self) -> Cells:
        """Samples along z, y, x."""
        z, y, x = (n + 2 * self.padding for n in self.values.shape)
        return z, y, x

    @property
    def cells(self) -> Cells:
        """Cells along z, y, x."""
        z, y, x = (n - 1 for n in self.samples)
        return z, y, x

    def add(self, start: Cells, brick: int) -> None:
        """Works on the brick that begins at a sample."""
        stop = tuple(min(first + brick, n) for first, n in zip(start, self.cells, strict=True))
        neighbors = [self.faces.pop((axis, *start), None) for axis in range(3)]
        block = _Block.read(self.values, self.level, self.padding, start, (stop[0], stop[1], stop[2]))
        if block is None:
            return
        places, triangles = block.march()
        keys, base, axis = _edges(places, start, self.samples)
        points, slopes = block.vertices(base, axis)
        numbers = np.full(len(keys), -1, np.int64)
        for face in neighbors:
            if face is not None:
                at = np.minimum(np.searchsorted(face.keys, keys), len(face.keys) - 1)
                known = face.keys[at] == keys
                numbers[known] = face.numbers[at[known]]
        new = numbers < 0
        numbers[new] = self.count + np.arange(np.count_nonzero(new))
        self.count += int(np.count_nonzero(new))
        self.points.append(self.origin + (points[new] - self.padding) @ self.directions)
        # In scene units a slope is the inverse of the steps times that along the axes (transposed for rows).
        self.normals.append(_unit(slopes[new] @ (-np.linalg.inv(self.directions).T)))
        # A left-handed grid is seen in a mirror, where triangles turn around.
        turn = 1 if np.linalg.det(self.directions) > 0 else -1
        self.triangles.append(numbers[triangles[:, ::turn]].astype(np.int32))
        for along in range(3):
            if stop[along] < self.cells[along]:
                on = (base[:, along] == stop[along]) & (axis != 2 - along) & (axis != _CENTER)
                if on.any():
                    order = np.argsort(keys[on])
                    beyond = [*start]
                    beyond[along] = stop[along]
                    self.faces[along, beyond[0], beyond[1], beyond[2]] = _Face(
                        keys[on][order], numbers[on][order]
                    )

    def mesh(self) -> Mesh:
        """All of it."""
        points = _joined(self.points, np.float64)
        triangles = _joined(self.triangles, np.int32)
        normals = _joined(self.normals, np.float32)
        _fill_in(normals, points, triangles)
        return Mesh(points, triangles, normals)


def _joined(parts: list[npt.NDArray[Any]], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Arrays (n, 3) one after another; each is let go as soon as it is copied."""
    result = np.empty((sum(len(part) for part in parts), 3), dtype)
    end = len(result)
    while parts:
        part = parts.pop()
        result[end - len(part) : end] = part
        end -= len(part)
    return result


def _unit(vectors: Doubles) -> npt.NDArray[np.float32]:
    """Vectors of length 1; zero where there is no direction."""
    with np.errstate(all="ignore"):
        scaled = vectors / np.abs(vectors).max(axis=1, keepdims=True, initial=0)
        scaled /= np.linalg.norm(scaled, axis=1, keepdims=True)
    scaled[~np.isfinite(scaled).all(axis=1)] = 0
    return np.asarray(scaled, np.float32)


def _fill_in(normals: npt.NDArray[np.float32], points: Doubles, triangles: npt.NDArray[np.int32]) -> None:
    """Gives the vertices without a normal the mean of the triangles around, by area."""
    missing = np.asarray(~np.any(normals, axis=1), np.bool_)
    if not missing.any():
        return
    some = triangles[missing[triangles].any(axis=1)]
    corners = points[some]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    numbers, places = np.unique(some.reshape(-1), return_inverse=True)
    each = [np.bincount(places.reshape(-1), np.repeat(along, 3), len(numbers)) for along in flat.T]
    sums = np.array(each, np.float64).T
    asked = missing[numbers]
    normals[numbers[asked]] = _unit(sums[asked])


def _edges(places: Values, start: Cells, samples: Cells) -> tuple[Keys, Keys, Keys]:
    """Keys of vertices; the sample (z, y, x) that their edge begins at; and along which of x, y, z it goes.

    `places`: (n, 3), z, y, x within the brick. Along two of the three a vertex of an edge is at a sample.
    """
    between = np.abs(places - np.rint(places)) > 1e-3
    base = np.floor(places).astype(np.int64)
    on_sample = ~between
    base[on_sample] = np.rint(places[on_sample]).astype(np.int64)
    base += np.array(start)
    axis = np.where(between.sum(axis=1) == 1, 2 - np.argmax(between, axis=1), _CENTER)
    keys = ((base[:, 0] * samples[1] + base[:, 1]) * samples[2] + base[:, 2]) * 4 + axis
    return keys, base, axis


@dataclass(frozen=True, slots=True)
class _Block:
    """A brick's differences to the level, with one more sample around it for slopes; outside ones beyond the grid.

    Attributes:
        differences: float64 or float32, (z, y, x).
        start: the sample (z, y, x) that `differences` begins with.
        inner: the brick's own samples in it.
        outside: where there is no voxel.
    """

    differences: Values
    start: Keys
    inner: tuple[slice, slice, slice]
    outside: npt.NDArray[np.bool_]

    @staticmethod
    def read(values: Values, level: float, padding: int, start: Cells, stop: Cells) -> _Block | None:
        """The brick of the samples from `start` to `stop`; None if all of them are on one side."""
        own, around, margins, inner = [], [], [], []
        for first, last, n in zip(start, stop, values.shape, strict=True):
            # In voxels: of the brick itself, and with a margin, as far as there are any.
            low, high = first - padding, last - padding + 1
            own.append(slice(max(low, 0), min(high, n)))
            around.append(slice(max(low - 1, 0), min(high + 1, n)))
            margins.append((around[-1].start - (low - 1), high + 1 - around[-1].stop))
            inner.append(slice(1, 1 + high - low))
        part = np.asarray(values[around[0], around[1], around[2]])
        small = part.dtype.itemsize <= 2 or part.dtype == np.float32
        differences: Values = part.astype(np.float32 if small else np.float64)
        differences -= level
        own_part = tuple(slice(o.start - a.start, o.stop - a.start) for o, a in zip(own, around, strict=True))
        is_inside = differences[own_part] >= 0
        whole = is_inside.size == np.prod([s.stop - s.start for s in inner])
        if not is_inside.any() or (whole and is_inside.all()):
            return None
        padded = np.pad(differences, margins, mode="edge")
        outside = np.pad(np.zeros(part.shape, np.bool_), margins, constant_values=True)
        return _Block(padded, np.array(start) - 1, (inner[0], inner[1], inner[2]), outside)

    def march(self) -> tuple[Values, Values]:
        """Vertices (z, y, x) from the brick's first sample on, on edges or in cells, and triangles from outside."""
        from skimage.measure import marching_cubes

        d = self.differences[self.inner]
        tall = np.clip(np.nan_to_num(np.abs(d), nan=_LEAST), _LEAST, _LARGEST).astype(np.float32)
        for _ in range(5):
            np.sqrt(tall, out=tall)
        tall *= _TALL
        is_inside = (d >= 0) & ~self.outside[self.inner]
        tall[is_inside] *= _INSIDE_MORE
        tall[self.outside[self.inner]] = _TALL
        np.negative(tall, out=tall, where=~is_inside)
        marching: Any = marching_cubes  # without types
        places, triangles, _, _ = marching(tall, 0.0, gradient_direction="descent")
        return places, triangles

    def vertices(self, base: Keys, axis: Keys) -> tuple[Doubles, Doubles]:
        """Places (x, y, z) of samples, and slopes of the values along x, y, z there."""
        points = np.empty((len(base), 3))
        slopes = np.empty((len(base), 3))
        local = base - self.start
        on_edge = axis != _CENTER
        with np.errstate(all="ignore"):  # values may be infinite, or none
            field = self._slopes()
            points[on_edge], slopes[on_edge] = self._on_edges(local[on_edge], axis[on_edge], field)
            if not on_edge.all():
                points[~on_edge], slopes[~on_edge] = self._in_cells(local[~on_edge], field)
        slopes[~np.isfinite(slopes)] = 0
        return points, slopes

    def _on_edges(self, local: Keys, axis: Keys, field: list[Values]) -> tuple[Doubles, Doubles]:
        step = np.eye(3, dtype=np.int64)[2 - axis]
        ends = [local, local + step]
        d = [self.differences[tuple(end.T)].astype(np.float64) for end in ends]
        t = d[0] / (d[0] - d[1])
        t[~np.isfinite(t)] = 0.5
        np.clip(t, _FROM_END, 1 - _FROM_END, out=t)
        beyond = [self.outside[tuple(end.T)] for end in ends]
        cut = beyond[0] | beyond[1]
        t[cut] = 0.5
        # Whole numbers of the whole grid first: rounded the same in every brick.
        points = (local + self.start + t[:, None] * step)[:, ::-1]
        slopes = np.stack(
            [(1 - t) * each[_kept(ends[0], each)] + t * each[_kept(ends[1], each)] for each in field], axis=1
        )
        # A cut face looks out of the box.
        slopes[cut] = (step * (beyond[0].astype(np.int64) - beyond[1])[:, None])[cut][:, ::-1]
        return points, slopes

    def _in_cells(self, local: Keys, field: list[Values]) -> tuple[Doubles, Doubles]:
        """The middle of the places where the surface crosses the edges of a cell."""
        sums, slopes, counts = np.zeros((len(local), 3)), np.zeros((len(local), 3)), np.zeros(len(local))
        for axis in range(3):
            across = [a for a in range(3) if a != axis]
            for one, two in product((0, 1), (0, 1)):
                offset = np.zeros(3, np.int64)
                offset[[2 - across[0], 2 - across[1]]] = one, two
                begin = local + offset
                end = begin + np.eye(3, dtype=np.int64)[2 - axis]
                crosses = np.flatnonzero(self._is_inside(begin) != self._is_inside(end))
                place, slope = self._on_edges(begin[crosses], np.full(len(crosses), axis), field)
                sums[crosses] += place
                slopes[crosses] += slope
                counts[crosses] += 1
        return sums / counts[:, None], slopes / counts[:, None]

    def _is_inside(self, at: Keys) -> npt.NDArray[np.bool_]:
        index = tuple(at.T)
        return np.asarray((self.differences[index] >= 0) & ~self.outside[index])

    def _slopes(self) -> list[Values]:
        """Central differences along x, y, z of the block's inner samples, weighted 1 2 1 along the others (Sobel's)."""
        d = self.differences
        if d.dtype.kind == "f":
            # Of a jump by more than this only the direction matters, and sums stay finite.
            d = np.clip(np.nan_to_num(d), -1e30, 1e30)
        blurred_x = _blur(d, 2)
        return [
            _blur(_blur(_difference(d, 2), 1), 0),
            _blur(_difference(blurred_x, 1), 0),
            _difference(_blur(blurred_x, 1), 0),
        ]


def _kept(at: Keys, inner: Values) -> tuple[Keys, ...]:
    """Samples of a block among its inner ones; of those that the margin has its neighbour inside."""
    return tuple(np.clip(at[:, axis] - 1, 0, inner.shape[axis] - 1) for axis in range(3))


def _along(axis: int, part: slice) -> tuple[slice, ...]:
    return tuple(part if a == axis else slice(None) for a in range(3))


def _difference(d: Values, axis: int) -> Values:
    """Half of what changes from the sample before to the one after; one sample less at both ends."""
    result: Values = d[_along(axis, slice(2, None))] - d[_along(axis, slice(0, -2))]
    result *= 0.5
    return result


def _blur(d: Values, axis: int) -> Values:
    """Weighted 1 2 1; one sample less at both ends."""
    result: Values = d[_along(axis, slice(2, None))] + d[_along(axis, slice(0, -2))]
    result *= 0.5
    result += d[_along(axis, slice(1, -1))]
    result *= 0.5
    return result
