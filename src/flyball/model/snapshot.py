"""Copies and unchangeable snapshots of a model, and the cache of what was computed from a snapshot."""

from __future__ import annotations

import dataclasses
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from copy import copy
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..errors import ModelError
from .body import Initial
from .element import Element, python_data
from .messages import listing, suggest

if TYPE_CHECKING:
    from .element import Element
    from .model import Model


T = TypeVar("T")


class ResultCache:
    """A cache of results of pure functions of its owner, the last few of each kind.

    It belongs to the process: a copy or a pickle of the owner starts with an empty cache. Two threads may both compute
    the same entry; since the functions are pure, this is harmless.
    """

    def __init__(self) -> None:
        self._found: dict[str, OrderedDict[Hashable, Any]] = {}
        self._lock = threading.Lock()

    def get(self, kind: str, key: Hashable, most: int, make: Callable[[], T]) -> T:
        """Return the result of ``make``, new or cached; for each kind the ``most`` last used are kept."""
        with self._lock:
            known = self._found.get(kind)
            if known is not None and key in known:
                if most > 1:
                    known.move_to_end(key)
                return known[key]
        made = make()
        with self._lock:
            known = self._found.setdefault(kind, OrderedDict())
            known[key] = made
            while len(known) > most:
                known.popitem(last=False)
        return made

    def known(self, kind: str, key: Hashable = None) -> Any:
        """Return the cached result, else None."""
        with self._lock:
            return self._found.get(kind, OrderedDict()).get(key)

    def drop(self, kind: str, key: Hashable) -> None:
        """Remove one of them."""
        with self._lock:
            self._found.get(kind, OrderedDict()).pop(key, None)

    def take(self, kind: str, other: ResultCache, convert: Callable[[Any], Any]) -> None:
        """Fill the cache with converted results of a kind from another cache."""
        with other._lock:
            found = other._found.get(kind, OrderedDict()).copy()
        self._found[kind] = OrderedDict((key, convert(x)) for key, x in found.items())

    def __reduce__(self) -> Any:
        return ResultCache, ()


def exact_key(values: Mapping[str, Any]) -> Hashable:
    """Return a key of numbers by name that distinguishes every bit, also for complex numbers."""
    x = np.array(list(values.values()))
    return tuple(values), x.dtype.char, x.tobytes()


CATEGORIES = (
    "materials",
    "material_pairs",
    "ground",
    "bodies",
    "bulk",
    "frames",
    "joints",
    "couplings",
    "tables",
    "sensors",
    "controllers",
    "forces",
    "drivers",
    "initial",
    "contacts",
    "limits",
    "events",
)
SETTINGS = ("name", "planar", "gravity_told")


def model_copy(model: Model) -> Any:
    """Return a model with lists of its own that can be changed."""
    out = object.__new__(type(model))
    vars(out).update(vars(model))
    vars(out).pop("cache", None)
    vars(out).update({"_snapshot": None, "frozen": False, "parameters": dict(model.parameters)})
    vars(out)["gravity"] = copy(model.gravity)  # it may be a list
    vars(out).update(
        {name: list(getattr(model, name)) for name in CATEGORIES}
        | {"by_name": dict(model.by_name), "groups": set(model.groups)}
    )
    return out


def snapshot(model: Model) -> Any:
    """Return the model as an immutable snapshot; the last one if nothing has changed since."""
    last = vars(model).get("_snapshot")
    if model.frozen or (last is not None and _same(model, last)):
        return model if model.frozen else last
    out = model_copy(model)
    vars(out).update({"_resolved": None, "gravity": _gravity(model)})
    out.environment()  # computed now: nothing is stored in it later
    vars(out).update({name: tuple(getattr(model, name)) for name in CATEGORIES})
    vars(out).update({"parameters": MappingProxyType(out.parameters), "by_name": MappingProxyType(_by_name(out))})
    vars(out).update({"cache": ResultCache(), "frozen": True})
    if last is not None and _same_parts(model, last):  # other parameter values leave every structure unchanged
        out.cache.take("spanning", last.cache, lambda tree: tree)
        out.cache.take("structure", last.cache, lambda s: dataclasses.replace(s, model=out))
    vars(model)["_snapshot"] = out
    return out


def _by_name(model: Model) -> dict[str, Element]:
    """Return the parts in the lists, in the order they were added: users may change the lists directly."""
    there: dict[str, Element] = {}
    for category in CATEGORIES:
        parts = getattr(model, category)
        if any(getattr(e, "category", None) != category for e in parts):
            raise ModelError(f"{category} of {model.name!r} contain something else: {parts!r}; use m.add")
        names = [e.name for e in parts]
        if len(set(names)) < len(names) or (category != Initial.category and not there.keys().isdisjoint(names)):
            twice = next(x for k, x in enumerate(names) if x in names[:k] or x in there)
            raise ModelError(f"{model.name!r} has two parts named {twice!r}; names must be unique")
        there |= dict(zip(names, parts, strict=True)) if category != Initial.category else {}
    return {name: there[name] for name in model.by_name if name in there} | there


def picklable_state(state: Mapping[str, Any]) -> dict[str, Any]:
    """Return the pickled state of a model, without cached results."""
    out = {k: v for k, v in state.items() if k not in ("_snapshot", "cache", "frozen", "_resolved")}
    out |= {name: list(state[name]) for name in CATEGORIES if name in state}
    return out | {"_resolved": None, "parameters": dict(state["parameters"]), "by_name": dict(state["by_name"])}


def changed_copy(model: Model, parts: Mapping[str, Element | None]) -> Any:
    """Return a copy with other parts under these names, or without them (None)."""
    if not isinstance(parts, Mapping):
        raise ModelError(f"parts maps names to parts, or to None to leave one out: {{'A': None}}; not {parts!r}")
    for name, e in parts.items():
        if name in model.parameters:
            raise ModelError(f"{name!r} is a parameter of {model.name!r}: m.parameters[{name!r}] = ..., or parameters=")
        if name not in model.by_name:
            known = list(model.by_name)
            raise ModelError(f"{model.name!r} has no part {name!r}{suggest(str(name), known)}; {listing(known)}")
        if not (e is None or isinstance(e, Element)):
            raise ModelError(f"a part is exchanged for a part, or for None, not {e!r}: {name!r}")
    out = model_copy(model)
    owned: dict[str, Element | None] = {p.name: None for name in parts for p in _parts_of(model, model.find(name))}
    new = [p for e in parts.values() for p in _parts_of(model, e)]
    put_parts(out, owned | {p.name: p for p in new} | dict(parts))
    out.forces = [e.bound(out) for e in out.forces]
    out.by_name |= {e.name: e for e in out.forces}
    for p in new:
        if p not in getattr(out, p.category):
            getattr(out, p.category).append(p)
            out.by_name[p.name] = p
    return out


def put_parts(model: Model, parts: Mapping[str, Element | None]) -> None:
    """Put other parts under these names into a model, or remove them (None)."""
    for category in CATEGORIES:
        if category != Initial.category:  # the names of these parts are derived from what they refer to
            kept = [parts.get(e.name, e) for e in getattr(model, category)]
            setattr(model, category, [e for e in kept if e is not None and e.category == category])
    left = {name: parts.get(name, e) for name, e in model.by_name.items()}
    model.by_name = {name: e for name, e in left.items() if e is not None}


def _parts_of(model: Model, e: Element | None) -> tuple[Element, ...]:
    return () if e is None else e.parts(model)


def hidden_parts(model: Model) -> set[str]:
    """Return the names of the elements that belong to others and that pictures leave out."""
    return {name for name, e in part_owners(model).items() if not e.shows_parts}


def part_owners(model: Model) -> dict[str, Element]:
    """Return the names of the elements that belong to others, with these."""
    return {p.name: e for e in model.elements() for p in e.parts(model)}


def refuse_changes(model: Model, what: str) -> None:
    """Refuse to change a snapshot, on which results and prepared data depend."""
    if model.frozen:
        raise ModelError(f"{what}: {model.name!r} is here as a result has it, for good; change a copy of it: m.copy()")


def _same(model: Model, last: Model) -> bool:
    """Return whether every part is the same object, and every parameter and setting equal to the bit."""
    return _same_parts(model, last) and same_values(model.parameters, last.parameters)


def same_values(a: Mapping[str, Any], b: Mapping[str, Any]) -> bool:
    """Return whether the same names in the same order have equal values of equal types, to the bit."""
    return list(a) == list(b) and all(_same_bits(v, b[k]) for k, v in a.items())


def _same_parts(model: Model, last: Model) -> bool:
    """Return whether everything but the parameter values is equal."""
    mine, its = vars(model), vars(last)
    for k in CATEGORIES:
        a, b = mine[k], its[k]
        if len(a) != len(b):
            return False
        for x, y in zip(a, b, strict=True):
            if x is not y:
                return False
    for k in SETTINGS:
        if not _same_bits(mine[k], its[k]):
            return False
    gravity = _same_bits(_gravity(model), last.gravity) and type(model) is type(last)
    return gravity and list(model.parameters) == list(last.parameters)


def _gravity(model: Model) -> tuple[Any, ...]:
    """Return gravity as a tuple: users may pass and later change a list or an array."""
    return model.gravity if isinstance(model.gravity, tuple) else tuple(python_data(model.gravity))


def _same_bits(a: Any, b: Any) -> bool:
    """Return whether two numbers or texts are identical; 0.0 and -0.0 are not."""
    return a is b or (type(a) is type(b) and a == b and repr(a) == repr(b))
