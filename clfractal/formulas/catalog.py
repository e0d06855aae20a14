"""Finds formulas: in the library, in a file, in a scene; and turns what a scene says into a chain."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from clfractal.errors import FormulaError, Where, unknown_name
from clfractal.files.resources import folder
from clfractal.formulas.binding import bind, check_radius
from clfractal.formulas.build import bounds_from_mapping, formula_from_mapping
from clfractal.formulas.chain import MAX_COUNT, MAX_LINKS, Chain, Link
from clfractal.formulas.definition import Formula, inside
from clfractal.formulas.evaluate import evaluate_constant
from clfractal.formulas.include import document_with_included, plain_with_included
from clfractal.formulas.names import check_keys
from clfractal.formulas.own import find_own, library_names, safe_path
from clfractal.formulas.turns import MAX_START

_SOURCES = ("name", "file", "inline", "chain")
_OPTIONS = ("parameters", "live", "julia", "bailout", "distance_bailout")
_IGNORED = ("iterations",)
_TURNS = ("count", "start", "stop")
_CHAIN_KEYS = (
    *("title", "reference", "description", "chain", "bounds", "bailout", "distance_bailout"),
    "step_scale",
)


@cache
def names() -> tuple[str, ...]:
    """The library's names, sorted: formulas and chains that have a set (see `Formula.alone`)."""
    return tuple(name for name in library_names() if not _is_alone(name))


def _is_alone(name: str) -> bool:
    # (Few say anything of it, and to read all files takes as long as a shell's user notices.)
    text = (folder("formulas/library") / f"{name}.yaml").read_text(encoding="utf-8")
    return "alone:" in text and bool(description(name).get("alone"))


@cache
def description(name: str) -> Mapping[str, Any]:
    """A library file as plain data; FormulaError with the nearest name for one that does not exist."""
    if name not in library_names():
        raise FormulaError(unknown_name("formula", name, library_names()))
    return _read(folder("formulas/library") / f"{name}.yaml", f"{name}.yaml")[0]


def described(name: str, beside: Path) -> tuple[Mapping[str, Any], Chain]:
    """A formula's file as plain data, and its chain, for a name of the library or of one's own; errors as `resolve`'s."""
    path = find_own(name, beside, Where())
    if path is None:
        return description(name), load_chain(name)
    return _read(path, str(path), beside)[0], resolve({"name": name}, beside)


def is_chain(name: str) -> bool:
    """Whether a library name is a chain rather than a single formula."""
    return "chain" in description(name)


@cache
def load(name: str) -> Formula:
    """A formula of the library; FormulaError for an unknown name, or the name of a chain."""
    data = description(name)
    if "chain" in data:
        raise FormulaError(f"{name!r} is a chain of formulas, not a single one")
    return formula_from_mapping(data, Where(f"{name}.yaml"), name=name)


def load_chain(formula: str | Path | Mapping[str, Any], parameters: Mapping[str, Any] | None = None) -> Chain:
    """The chain of a name, of a file (a Path, or a text that ends in .yaml or .yml) or of a mapping.

    The mapping may be a scene's `formula` section (see `resolve`) or a formula itself. A name is one of the library or
    of one's own (`own.py`), with the current folder in the place of a scene's.

    Raises:
        FormulaError, FileError: as `resolve`; and for `none`, of which nothing can be asked.
    """
    chain = _chain_of(formula, parameters)
    check_has_set(chain, Where())
    return chain


def check_has_set(chain: Chain, where: Where) -> None:
    """Raises FormulaError for a formula whose set is empty."""
    if chain.alone:
        name = chain.first.formula.name
        raise FormulaError(f"{name} is for scenes of objects alone; name a formula", where)


def _chain_of(formula: str | Path | Mapping[str, Any], parameters: Mapping[str, Any] | None) -> Chain:
    spec: dict[str, Any] = {"parameters": parameters} if parameters else {}
    if isinstance(formula, Path) or (isinstance(formula, str) and formula.endswith((".yaml", ".yml"))):
        path = Path(formula)
        return resolve({"file": path.name, **spec}, path.parent)
    if isinstance(formula, str):
        return resolve({"name": formula, **spec}, Path())
    if any(key in formula for key in _SOURCES):
        return resolve({**formula, **spec})
    return resolve({"inline": formula, **spec})


def resolve(spec: Mapping[str, Any], base_folder: Path | None = None, where: Where | None = None) -> Chain:
    """The chain that a scene's `formula` section describes.

    Args:
        spec: one of `name` (of the library, or of one's own), `file`, `inline` (a formula's mapping), `chain` (a list of
            such mappings, each with `count`, `start` and `stop`), and `parameters`, `live`, `julia`, `bailout`,
            `distance_bailout`. For a chain `julia` goes to every link that adds the point, `parameters` and `live` are
            not allowed.
        base_folder: the folder that `file` is relative to and must stay in; None: files are not allowed. The
            folder `formulas` in it holds formulas of one's own.
        where: where the section stands; errors add the path below it, and the column inside an expression.

    Raises:
        FormulaError: anything wrong in the section or in a formula.
        FileError: a file that cannot be read, or lies outside the folder.
    """
    return _Resolver(base_folder, base_folder).chain(spec, where or Where())


class _Resolver:
    """Resolves one section: files are read relative to one folder, formulas of one's own are found by name beside another.

    The two differ for what a formula of one's own names: `beside` is the scene's folder.
    """

    def __init__(self, base_folder: Path | None, beside: Path | None) -> None:
        self.base_folder, self.beside = base_folder, beside

    def chain(self, spec: Mapping[str, Any], where: Where) -> Chain:
        key = _source_key(spec, where, (*_OPTIONS, *_IGNORED))
        own = self._own(spec, where)
        if own is not None:
            return own[0].chain(own[1], where)
        data, place, source = self._data(key, spec, where)
        if "chain" not in data:
            link = self._link(spec, where, data, place, source)
            try:
                return Chain((link,), title=link.bound.formula.title, source={**source, **_options(spec)})
            except FormulaError as error:
                raise FormulaError(error.message, where) from None
        for option, what in (("parameters", "give them to"), ("live", "name live ones in")):
            if spec.get(option):
                message = f"a chain has no parameters of its own; {what} its formulas"
                raise FormulaError(message, inside(where, option))
        return self._links(spec, where, data, place, key)

    def _own(self, spec: Mapping[str, Any], where: Where) -> tuple[_Resolver, Mapping[str, Any]] | None:
        """For the name of a formula of one's own: the section with its file, and what reads that folder's files."""
        name = spec.get("name")
        path = find_own(name, self.beside, inside(where, "name")) if isinstance(name, str) else None
        if path is None:
            return None
        real = path.resolve()
        section = {key: value for key, value in spec.items() if key != "name"}
        return _Resolver(real.parent, self.beside), {"file": real.name, **section}

    def _data(
        self, key: str, spec: Mapping[str, Any], where: Where
    ) -> tuple[Mapping[str, Any], Where, Mapping[str, Any]]:
        """The file's mapping, where it stands, and the part of a source that stands for it."""
        value = spec[key]
        here = inside(where, key)
        if key == "chain":
            return {"chain": value}, where, {}
        if key == "inline":
            if not isinstance(value, Mapping):
                raise FormulaError("must be a mapping, a formula's keys", here)
            value = plain_with_included(value, here, folder=self.base_folder, beside=self.beside)
            return value, here, {"inline": value}
        if not isinstance(value, str):
            raise FormulaError("must be text", here)
        if key == "name":
            return description(value), Where(f"{value}.yaml"), {"name": value}
        if self.base_folder is None:
            raise FormulaError("a formula file needs a scene file, in whose folder it is looked for", here)
        data, _ = _read(safe_path(value, self.base_folder, here), value, self.beside)
        return data, Where(value), {"inline": data}

    def _link(
        self,
        spec: Mapping[str, Any],
        where: Where,
        data: Mapping[str, Any],
        place: Where,
        source: Mapping[str, Any],
    ) -> Link:
        if "name" in source:
            formula = load(str(source["name"]))
        else:
            name = Path(place.file).stem if place.file and place != where and "file" in spec else "inline"
            formula = self._formula(data, place, name)
        parameters = spec.get("parameters") or {}
        if not isinstance(parameters, Mapping):
            raise FormulaError("must be a mapping of names to numbers", inside(where, "parameters"))
        bound = bind(
            formula,
            parameters,
            spec.get("julia"),
            spec.get("bailout"),
            where,
            distance_bailout=spec.get("distance_bailout"),
            live=spec.get("live") or (),
        )
        count = _whole(spec.get("count", 1), 1, MAX_COUNT, inside(where, "count"))
        start = _whole(spec.get("start", 0), 0, MAX_START, inside(where, "start"))
        stop = spec.get("stop")
        if stop is not None:
            stop = _whole(stop, 1, MAX_START, inside(where, "stop"))
            if stop <= start:
                raise FormulaError(f"must be above start, {start}, got {stop}", inside(where, "stop"))
        return Link(bound, count, start, stop)

    def _formula(self, data: Mapping[str, Any], place: Where, name: str) -> Formula:
        if place.file is None or self.base_folder is None:
            return _parsed_once(data, place, name)
        try:
            return formula_from_mapping(data, Where(), name=name)
        except FormulaError as error:
            # Read again, for the line and column that the plain data no longer has.
            document = _read(self.base_folder / place.file, place.file, self.beside)[1]
            raise document.locate(error) from None

    def _links(
        self, spec: Mapping[str, Any], where: Where, data: Mapping[str, Any], place: Where, key: str
    ) -> Chain:
        check_keys(data, _CHAIN_KEYS, place)
        entries = data["chain"]
        here = inside(place, "chain")
        if not isinstance(entries, Sequence) or isinstance(entries, str) or not entries:
            raise FormulaError("must be a list of formulas", here)
        if len(entries) > MAX_LINKS:
            raise FormulaError(f"must be at most {MAX_LINKS} formulas, got {len(entries)}", here)
        links = []
        sources = []
        for index, entry in enumerate(entries):
            at = inside(here, str(index))
            if not isinstance(entry, Mapping):
                raise FormulaError("must be a mapping with name, file or inline", at)
            entry_key = _source_key(entry, at, (*_OPTIONS, *_TURNS))
            reader: _Resolver = self
            own = self._own(entry, at)
            if own is not None:
                (reader, entry), entry_key = own, "file"
            entry_data, entry_place, entry_source = reader._data(entry_key, entry, at)
            if "chain" in entry_data:
                raise FormulaError("a chain cannot hold another chain", inside(at, entry_key))
            merged = self._with_julia(entry, spec, entry_data)
            link = reader._link(merged, at, entry_data, entry_place, entry_source)
            if link.bound.formula.alone:
                message = f"{link.bound.formula.name} cannot be a member of a chain; remove it"
                raise FormulaError(message, inside(at, entry_key))
            links.append(link)
            turns = {option: merged[option] for option in _TURNS if merged.get(option) is not None}
            sources.append({**entry_source, **_options(merged), **turns})
        radii = {
            option: check_radius(
                spec.get(option, data.get(option)), inside(where if option in spec else place, option)
            )
            for option in ("bailout", "distance_bailout")
        }
        overrides = {name: data[name] for name in ("bounds", "step_scale", "title") if name in data}
        source = {"inline": {"chain": sources, **overrides}} if overrides else {"chain": sources}
        if key == "name":
            source = {"name": spec["name"], **_options({"julia": spec.get("julia")})}
        try:
            return Chain(
                tuple(links),
                bounds_override=_bounds(data, place),
                bailout_override=radii["bailout"],
                distance_bailout_override=radii["distance_bailout"],
                step_scale_override=_step_scale(data, place),
                title=str(data.get("title", "Chain")),
                source={**source, **{name: value for name, value in radii.items() if value is not None}},
            )
        except FormulaError as error:
            raise FormulaError(error.message, here) from None

    def _with_julia(
        self, entry: Mapping[str, Any], spec: Mapping[str, Any], data: Mapping[str, Any]
    ) -> Mapping[str, Any]:
        if spec.get("julia") is None or data.get("add", "point") != "point" or entry.get("julia") is not None:
            return entry
        return {**entry, "julia": spec["julia"]}


# Formulas of scenes, the last used one last: a scene whose numbers change keeps its formula.
_PARSED: dict[tuple[str, str], Formula] = {}
_MOST_PARSED = 64


def _parsed_once(data: Mapping[str, Any], place: Where, name: str) -> Formula:
    """`formula_from_mapping`, with the same object for the same content."""
    try:
        key = (name, json.dumps(data))
    except (TypeError, ValueError, RecursionError):
        # Values that are not plain data are refused by the formula's own checks.
        return formula_from_mapping(data, place, name=name)
    formula = _PARSED.pop(key, None) or formula_from_mapping(data, place, name=name)
    _PARSED[key] = formula
    while len(_PARSED) > _MOST_PARSED:
        _PARSED.pop(next(iter(_PARSED)), None)
    return formula


def _source_key(spec: Mapping[str, Any], where: Where, others: tuple[str, ...]) -> str:
    check_keys(spec, (*_SOURCES, *others), where)
    given = [key for key in _SOURCES if spec.get(key) is not None]
    if len(given) != 1:
        got = " and ".join(given) if given else "none"
        raise FormulaError(f"needs exactly one of {', '.join(_SOURCES)}, got {got}", where)
    return given[0]


def _whole(value: object, low: int, high: int, where: Where) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise FormulaError(f"must be a whole number, {low} to {high}, got {str(value)[:60]}", where)
    return value


def _options(spec: Mapping[str, Any]) -> dict[str, Any]:
    return {key: spec[key] for key in _OPTIONS if spec.get(key) not in (None, {})}


def _bounds(data: Mapping[str, Any], place: Where) -> tuple[tuple[float, float, float], float] | None:
    if "bounds" not in data:
        return None
    center, radius = bounds_from_mapping(data["bounds"], (), inside(place, "bounds"))
    x, y, z = (evaluate_constant(node, {"julia": 0.0}) for node in center)
    size = check_radius(evaluate_constant(radius, {"julia": 0.0}), inside(place, "bounds", "radius"))
    return (x, y, z), size or 0.0


def _step_scale(data: Mapping[str, Any], place: Where) -> float | None:
    value = data.get("step_scale")
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value <= 2:
        raise FormulaError("must be above 0 and at most 2", inside(place, "step_scale"))
    return float(value)


def _read(path: Path, shown: str, beside: Path | None = None) -> tuple[Mapping[str, Any], Any]:
    """A YAML file's mapping, and the document that knows where everything in it stands."""
    from clfractal.files.document import read_document, read_text_file

    document = read_document(read_text_file(path, name=shown), shown, error=FormulaError)
    try:
        document = document_with_included(document, Where(), folder=path.parent, beside=beside)
    except FormulaError as error:
        raise document.locate(error) from None
    data = document.plain()
    if not isinstance(data, Mapping):
        raise FormulaError("must be a mapping, a formula's keys", Where(shown))
    return data, document
