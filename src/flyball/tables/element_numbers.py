"""Fields of every element in SI units at some parameter values, and the bodies' numbers.

They do not depend on the choice of coordinates. Only elements that name a changed parameter are evaluated again.
"""

from __future__ import annotations

import os
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..math.vec import cross, matrix_product
from ..model.body import GROUND, Body
from ..model.contact import shape_owners
from ..model.element import Element, resolve
from ..model.expression_parser import NAME
from ..model.expressions import Expression
from ..model.geometry import vector
from ..model.inertia import mass_properties
from ..model.model import Model
from ..model.snapshot import ResultCache, exact_key

EXACT_TYPES = (float, int, str, np.float64)  # types whose text identifies a value to the bit
MAX_CACHED = 4  # sets of parameter values that are cached


@dataclass(frozen=True)
class ElementNumbers:
    """Numbers of a mechanism's elements in SI units."""

    env: Mapping[str, Any]  # parameters
    of: Mapping[str, SimpleNamespace]  # element -> its fields
    # p, R, com: reference frame in the reference configuration, centre of mass in it
    bodies: Mapping[str, SimpleNamespace]
    key: Hashable  # equal keys mean equal numbers, to the bit
    # element -> its frames in the world in the reference configuration, computed when first needed
    placed: dict[str, Any]
    since: ResultCache  # identifies the numbers that were computed first
    changed: frozenset[str] = frozenset()  # elements whose numbers differ from those
    world: dict[Hashable, Any] = field(default_factory=dict)  # frame -> the same, with its carrier
    local: dict[Hashable, np.ndarray] = field(default_factory=dict)  # frame -> its pose on its body

    @cached_property
    def dtype(self) -> Any:
        """Number type of tables made from these: expressions, else complex numbers, else floats."""
        return number_type(self.env.values())


def number_type(values: Iterable[Any]) -> Any:
    """Number type of an array that holds these values."""
    kinds = {object if hasattr(x, "called") else complex if isinstance(x, complex) else float for x in values}
    return next((k for k in (object, complex) if k in kinds), float)


def element_numbers(model: Model, parameters: Mapping[str, Any] | None = None) -> ElementNumbers:
    """Numbers of a mechanism at the values of its parameters, with some of them changed.

    Raises
    ------
    ModelError
        If a number is invalid, or a parameter does not exist.
    """
    model = model.snapshot()
    env, kind, told = _environment(model, parameters or {})
    read = tuple(_file_state(path) for path in shape_files(model))
    if kind is object:
        return _evaluated(model, env, object())
    key = told, read
    return model.cache.get("numbers", key, MAX_CACHED, lambda: _updated(model, env, key))


def _environment(model: Model, parameters: Mapping[str, Any]) -> tuple[Mapping[str, Any], Any, Hashable]:
    """Values of all parameters (read-only), their number type, and a key of their bits."""
    if not all(type(x) in EXACT_TYPES for x in parameters.values()):
        return _with_bits(model.environment(parameters))
    written = tuple((name, type(x), repr(x)) for name, x in parameters.items())
    return model.cache.get("environment", written, MAX_CACHED, lambda: _with_bits(model.environment(parameters)))


def _with_bits(env: Mapping[str, Any]) -> tuple[Mapping[str, Any], Any, Hashable]:
    kind = number_type(env.values())
    units = tuple(getattr(env, "written", {}).items())  # to be checked, also where the numbers are equal
    return env, kind, None if kind is object else (exact_key(env), units)


def _updated(model: Model, env: Mapping[str, Any], key: Hashable) -> ElementNumbers:
    """Update the numbers that were computed first, if files are unchanged.

    Only elements that name a changed parameter are evaluated again.
    """
    first: ElementNumbers | None = model.cache.known("first numbers")
    if first is None or first.key[1] != key[1]:  # type: ignore[index]
        new = _evaluated(model, env, key)
        if new.dtype is not float:
            return new
        model.cache.drop("first numbers", None)  # outdated: files have changed
        model.cache.get("first numbers", None, 1, lambda: new)
        return new  # another thread may have stored others in the meantime
    named = model.cache.get("named", None, 1, lambda: _parameters_of_elements(model))
    other = {k for k, x in env.items() if not _same_bits(x, first.env[k])}
    other |= {k for k, text in getattr(env, "written", {}).items() if getattr(first.env, "written", {}).get(k) != text}
    changed = [e for e in model.elements() if e.name in named and not other.isdisjoint(named[e.name])]
    of = _with_needed_elements(model, {**first.of, **{e.name: _checked_fields(e, env) for e in changed}})
    bodies = {
        **first.bodies,
        **{e.name: _body_numbers(e, of[e.name], env, model.planar) for e in changed if isinstance(e, Body)},
    }
    other = {e.name for e in changed}
    placed = {name: frames for name, frames in first.placed.copy().items() if name not in other}
    return ElementNumbers(env, of, bodies, key, placed, first.since, frozenset(other))


def _evaluated(model: Model, env: Mapping[str, Any], key: Hashable) -> ElementNumbers:
    of = _with_needed_elements(model, {e.name: _checked_fields(e, env) for e in model.elements()})
    bodies = {GROUND: SimpleNamespace(p=np.zeros(3), R=np.eye(3), com=np.zeros(3), c=np.zeros(3))}
    for b in model.bodies:
        bodies[b.name] = _body_numbers(b, of[b.name], env, model.planar)
    return ElementNumbers(env, of, bodies, key, {}, ResultCache())


def _with_needed_elements(model: Model, of: dict[str, SimpleNamespace]) -> dict[str, SimpleNamespace]:
    """The same numbers, with those of another element added for the forces that depend on it."""
    for e in model.forces:
        if name := e.needs():
            of[e.name] = SimpleNamespace(**{**vars(of[e.name]), "of": of.get(name)})
    return of


def _checked_fields(e: Element, env: Mapping[str, Any]) -> SimpleNamespace:
    """Validated fields of an element in numbers at these values of the parameters."""
    n = resolve(e, env)
    if number_type(env.values()) is float:  # values with a complex step cannot be compared
        e.check(n)
    return n


def _same_bits(a: Any, b: Any) -> bool:
    """Whether two values are equal to the bit: 0.0 and -0.0 are not."""
    return type(a) is type(b) and a == b and (a != 0.0 or str(a) == str(b))


def _parameters_of_elements(model: Model) -> dict[str, frozenset[str]]:
    """Element -> parameters that its numbers may depend on: all that its texts name."""
    found = {e.name: frozenset(names_in(e)) & model.parameters.keys() for e in model.elements()}
    for e in model.forces:
        if name := e.needs():
            found[e.name] |= found.get(name, frozenset())
    return {name: frozenset(used) for name, used in found.items() if used}


def names_in(value: Any) -> Iterator[str]:
    """Names in the texts of an element, including shapes and lists in it."""
    if isinstance(value, str):
        yield from NAME.findall(value)
    elif isinstance(value, (tuple, list)):
        for x in value:
            yield from names_in(x)
    elif isinstance(value, Mapping):
        for x in value.values():
            yield from names_in(x)
    elif isinstance(value, Expression):
        yield from value.names
    elif is_dataclass(value):
        for f in fields(value):
            yield from names_in(getattr(value, f.name))


def _body_numbers(b: Body, n: SimpleNamespace, env: Mapping[str, float], planar: bool) -> SimpleNamespace:
    m = mass_properties(b, n, env, planar)
    R = b.rotation(n)
    p = vector(n.position, planar, b.name)
    w = np.zeros(3)
    arm = matrix_product(R, m.com)
    v = np.zeros(3) if n.velocity is None else vector(n.velocity, planar, b.name)
    if n.angular_velocity is not None:
        w = np.array([0, 0, n.angular_velocity]) if planar else vector(n.angular_velocity, False, b.name)
        v = v + np.array(cross(w, arm))
    return SimpleNamespace(
        p=p, R=R, com=m.com, mass=m.mass, inertia=m.inertia, volume=m.volume, c=p + arm, v=v, w=w, angle=n.angle
    )


def shape_files(model: Model) -> tuple[str, ...]:
    """Files that shapes are read from."""
    return model.cache.get(
        "files",
        None,
        1,
        lambda: tuple(f for b in shape_owners(model) for s in b.shapes() if (f := getattr(s, "file", None))),
    )


def _file_state(path: str) -> tuple[int, int] | None:
    """State of a file: it changes when the file does."""
    try:
        stat = os.stat(path)
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size


def unused_parameters(model: Model, names: Sequence[str]) -> list[str]:
    """Those of the given parameters that no element of the model uses, directly or through other parameters."""
    todo = {*names_in(model.gravity), *(w for e in model.elements() for w in names_in(e))} & model.parameters.keys()
    used: set[str] = set()
    while todo:
        used |= todo
        todo = ({w for name in todo for w in names_in(model.parameters[name])} & model.parameters.keys()) - used
    return [name for name in names if name not in used]
