"""Data classes as Python's own, made in a fifth of the time: every start of the program makes a hundred.

Python (up to 3.12) writes and compiles each method of each class. Here all classes share theirs, and `__init__` is compiled
when the first object is made: most classes of a start get none.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import field as field
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, slots=False, eq=True, kw_only=False):
        """As `dataclasses.dataclass`."""

        def made(cls):
            return _made(cls, frozen=frozen, slots=slots, eq=eq, kw_only=kw_only)

        return made if cls is None else made(cls)


def _made(cls: type, *, frozen: bool, slots: bool, eq: bool, kw_only: bool) -> type:
    given = vars(cls)
    own = set(given)
    # Of the fields, the slots and patterns Python's own takes care.
    made: type = dataclasses.dataclass(init=False, repr=False, eq=False, slots=slots, kw_only=kw_only)(cls)
    fields = dataclasses.fields(made)
    methods: dict[str, Any] = {
        "__init__": _late_init(made, frozen),
        "__repr__": _shown,
        "__signature__": _Signature(made, frozen),
    }
    if eq:
        methods["__eq__"] = _equality([each.name for each in fields if each.compare])
        counted = [each.name for each in fields if (each.compare if each.hash is None else each.hash)]
        # (A class that compares its objects has a `__hash__` of None, if it does not say otherwise.)
        if given.get("__hash__") is None:
            own.discard("__hash__")
        methods["__hash__"] = _hash(counted) if frozen else None
    if frozen:
        methods |= _refusals(made, frozenset(each.name for each in fields))
        if slots:
            methods |= {"__getstate__": _state, "__setstate__": _restore}
    for name, method in methods.items():
        if name not in own:
            setattr(made, name, method)
    return made


def _late_init(cls: type, frozen: bool) -> Callable[..., None]:
    """Makes the class's own `__init__` when it is first called."""

    def __init__(self: Any, /, *arguments: Any, **named: Any) -> None:  # noqa: N807 (it is that of a class)
        init = _init(cls, frozen)
        cls.__init__ = init  # type: ignore[misc]
        init(self, *arguments, **named)

    __init__.__qualname__ = f"{cls.__qualname__}.__init__"
    return __init__


class _Signature:
    """What `help` shows of a class's arguments, made when it is asked for."""

    def __init__(self, cls: type, frozen: bool) -> None:
        self._cls, self._frozen = cls, frozen

    def __get__(self, _instance: object, owner: type) -> Any:
        if owner is not self._cls:
            raise AttributeError("__signature__")  # a class below may have an `__init__` of its own
        import inspect

        types = {each.name: each.type for each in dataclasses.fields(owner)}
        found = inspect.signature(_init(owner, self._frozen))
        listed = [
            each.replace(annotation=types[each.name])
            for each in found.parameters.values()
            if each.name in types
        ]
        return found.replace(parameters=listed, return_annotation=None)


def _init(cls: type, frozen: bool) -> Callable[..., None]:
    names: dict[str, Any] = {"_set": object.__setattr__, "_missing": dataclasses.MISSING}
    several: dict[bool, list[str]] = {False: [], True: []}  # whether they are given by name only
    body = []
    for each in dataclasses.fields(cls):
        name, value = each.name, each.name
        if each.default_factory is not dataclasses.MISSING:
            names[f"_make_{name}"] = each.default_factory
            several[each.kw_only is True].append(f"{name}=_missing")
            value = f"_make_{name}() if {name} is _missing else {name}"
        elif each.default is not dataclasses.MISSING:
            names[f"_default_{name}"] = each.default
            several[each.kw_only is True].append(f"{name}=_default_{name}")
        else:
            several[each.kw_only is True].append(name)
        body.append(f" _set(_self, {name!r}, {value})" if frozen else f" _self.{name} = {value}")
    if hasattr(cls, "__post_init__"):
        body.append(" _self.__post_init__()")
    listed = ["_self", *several[False], *(["*"] if several[True] else []), *several[True]]
    exec(f"def __init__({', '.join(listed)}):\n" + "\n".join(body or [" pass"]), names)
    init: Callable[..., None] = names["__init__"]
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    init.__module__ = cls.__module__
    return init


def _values(names: list[str]) -> Callable[[Any], Any]:
    """The values of some fields of an object; of one field that value alone, in a tuple."""
    if not names:
        return lambda found: ()
    get = attrgetter(*names)
    return get if len(names) > 1 else lambda found: (get(found),)


def _equality(names: list[str]) -> Callable[[Any, Any], Any]:
    values = _values(names)

    def __eq__(self: Any, other: Any) -> Any:  # noqa: N807
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    return __eq__


def _hash(names: list[str]) -> Callable[[Any], int]:
    values = _values(names)
    return lambda found: hash(values(found))


@recursive_repr()
def _shown(found: Any) -> str:
    shown = [f"{each.name}={getattr(found, each.name)!r}" for each in dataclasses.fields(found) if each.repr]
    return f"{type(found).__qualname__}({', '.join(shown)})"


def _state(found: Any) -> list[Any]:
    return [getattr(found, each.name) for each in dataclasses.fields(found)]


def _restore(found: Any, state: list[Any]) -> None:
    for each, value in zip(dataclasses.fields(found), state, strict=True):
        object.__setattr__(found, each.name, value)


def _refusals(cls: Any, fields: frozenset[str]) -> dict[str, Callable[..., None]]:
    """Nothing of a frozen object is set or deleted."""

    def __setattr__(self: Any, name: str, value: Any) -> None:  # noqa: N807
        if type(self) is cls or name in fields:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:  # noqa: N807
        if type(self) is cls or name in fields:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return {"__setattr__": __setattr__, "__delattr__": __delattr__}
