"""Mechanisms with parameters in all of their numbers, and the derivatives of their tables in two ways."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import flyball as fb
from flyball.errors import ModelError
from flyball.forces.wheel_rail_geometry import PLACES_WIDTH
from flyball.forces.wheel_rail_geometry import RAIL_WIDTH as WHEEL_RAIL
from flyball.model.element import Unit, fields_with
from flyball.model.expressions import number
from flyball.model.snapshot import CATEGORIES, part_owners
from flyball.tables.structure_definition import Structure
from flyball.tables.table_definitions import REVOLUTE
from flyball.tables.values import Values, values

STEP = 1e-30
STEPS = (1e-3, 1e-4, 1e-5, 1e-6)  # of the differences, one after the other where they do not agree
Tables = dict[str, np.ndarray]
Derivative = Callable[[], Tables]


class _Numbers:
    """Lets every number of a mechanism depend on the parameter of its field, each in its own way."""

    def __init__(self, planar: bool, env: dict[str, float]) -> None:
        self.planar, self.env = planar, env
        self.names: dict[str, str] = {}  # field -> parameter
        self.count = 0

    def element(self, e: Any) -> Any:
        """The element with parameters in its numbers, those of its shapes too."""
        new = {}
        for name, unit in fields_with(type(e), Unit).items():
            value = getattr(e, name)
            of_the_plane = not self.planar and isinstance(e, fb.Bushing) and name == "angle"
            if value is not None and not of_the_plane and not (self.planar and name == "inertia_about"):
                new[name] = self.value(value, f"{type(e).__name__}.{name}", unit.dimension)
        if isinstance(e, fb.Body) and e.shape is not None:
            shapes = tuple(self.element(s) for s in e.shapes())
            new["shape"] = shapes if isinstance(e.shape, tuple) else shapes[0]
        return dataclasses.replace(e, **new)

    def value(self, x: Any, field: str, dimension: str | None) -> Any:
        """What is written, with a multiple of the field's parameter added to each of its numbers."""
        if isinstance(x, tuple):
            if field == "Body.inertia" and isinstance(x[0], tuple):
                upper = {(i, j): self.value(x[i][j], field, dimension) for i in range(3) for j in range(i, 3)}
                return tuple(tuple(upper[min(i, j), max(i, j)] for j in range(3)) for i in range(3))
            kept = 2 if self.planar and len(x) == 3 and x[2] == 0.0 else len(x)
            return (*(self.value(y, field, dimension) for y in x[:kept]), *x[kept:])
        found = number(x, self.env, dimension, field)
        if field == "Rope.radii" and found == 0.0:  # a point, which is no pulley
            return x
        parameter = self.names.setdefault(field, f"p{len(self.names)}")
        self.count += 1
        weight = (abs(found) or 0.1) * (1.0 + 0.5 * math.cos(self.count)) * (-1.0) ** self.count
        try:
            x = repr(number(x, {}, dimension, field))
        except ModelError:
            x = f"({x})"
        return f"{x} + {weight!r}*{parameter}"


def with_parameters(m: fb.Mechanism) -> tuple[fb.Mechanism, dict[str, str]]:
    """A copy of a mechanism with a parameter, zero as it stands, for each field of its elements; field -> parameter."""
    numbers = _Numbers(m.planar, m.environment())
    owned = part_owners(m)
    every = [e for category in CATEGORIES for e in getattr(m, category) if e.name not in owned]
    parts = [numbers.element(e) for e in every]
    gravity = numbers.value(m.gravity, "gravity", "m/s^2")
    zeros = dict.fromkeys(numbers.names.values(), 0.0)
    out = fb.Mechanism(m.name, planar=m.planar, gravity=gravity, parameters={**m.parameters, **zeros})
    out.add(*parts)
    return out, numbers.names


def tables(x: Values) -> Tables:
    """The numbers of the tables by name.

    A constant rotation about a hinge's own axis may stand before or behind the hinge's (``_leave_out``); hinges are
    therefore given by where they bring the body at two angles. ``scale ...`` are lengths and inertias that are no
    physics but chosen as the largest of several, so that they have kinks: there the derivative is one of several.
    """
    S = x.system
    X = S.bodies
    out = {"mass": X.mass, "inertia": X.inertia, "per mass": X.inverse_mass, "offset": X.offset}
    for b in range(len(X.mass)):
        T, B = X.joint_rotation[b].reshape(3, 3), X.body_rotation[b].reshape(3, 3)
        angles = (0.0, 0.7) if S.tree.joint[b] == REVOLUTE else (0.0,)
        poses = [T @ about_z(a) @ np.column_stack([B, X.body_position[b]]) for a in angles]
        out[f"tree joint {b}"] = np.concatenate([X.joint_position[b], *(p.ravel() for p in poses)])
        if S.tree.joint[b] != REVOLUTE:
            own = (X.joint_position, X.joint_rotation, X.body_position, X.body_rotation)
            out[f"tree frames {b}"] = np.concatenate([x[b] for x in own])
    scaled = "scale of inverse" if X.excess_inertia.any() else "inverse"
    out |= {scaled: X.inverse_inertia, "scale of excess": X.excess_inertia}
    out |= {"scale": np.r_[X.inverse_reference_inertia, S.scales.length], "gravity": S.gravity}
    out |= {"frames": np.column_stack([S.frames.position, S.frames.rotation])}
    out |= {name: getattr(S, name) for name in ("term_parameters", "force_parameters")} | {"const": _constants(x)}
    return out | {"q": x.q, "v": x.v}


def _constants(x: Values) -> np.ndarray:
    """The constants without those that only begin a search: roughly known places of wheels' contacts, which jump."""
    out = x.system.const.copy()
    for k, e in enumerate(x.structure.forces):
        if isinstance(e, fb.WheelOnRail):
            at = int(x.system.force_parameters[k, : WHEEL_RAIL + 1].real.sum())
            out[at : at + 2 * PLACES_WIDTH] = 0.0
    return out


def about_z(angle: float) -> np.ndarray:
    """Rotation about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def complex_tables(s: Structure, name: str) -> Tables:
    """Tables with a complex step of a parameter; a number that loses its imaginary part on the way is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = tables(values(s, {name: complex(s.model.environment()[name], STEP)}))
    assert all(a.dtype == complex for a in found.values())
    return found


def compared(make: Callable[[float], Tables], base: Tables, exact: Tables, size: float) -> Iterator[str]:
    """Which tables' derivatives (``exact``, imaginary parts by the step) are not those of ``make(change)``.

    ``base`` are the tables without a change. Those four steps away are made where a scale may have a kink.
    """
    second = STEP**2  # of the step, in real parts
    wrong = {k: ~_near(x.real, base[k], 1e-12, 1e-14 * largest(base[k]) + second) for k, x in exact.items()}
    yield from (f"{k}, real part: {exact[k].real[w]} for {base[k][w]}" for k, w in wrong.items() if w.any())
    left = {k: np.ones(x.shape, bool) for k, x in exact.items()}
    refused: ModelError | None = None
    tried: Tables = {}
    for step in STEPS:
        if not any(x.any() for x in left.values()):
            return
        h = step * size
        try:
            near = {k: make(k * h) for k in (-2, -1, 1, 2)}
        except ModelError as error:
            refused = error
            continue
        for k, x in exact.items():
            f = {j: near[j][k] for j in near} | {0: base[k]}
            d = x.imag / STEP
            noise = 1e-14 * np.maximum(largest(base[k]), k == "q") / h  # angles come from rotations, of size 1
            if k.endswith("inverse"):
                noise = noise * np.maximum(1.0, largest(base[k]) * largest(base["inertia"]))
            tried[k] = (8.0 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12.0 * h)
            rows = np.maximum(largest(d), largest(tried[k]))
            good = _near(d, tried[k], 1e-7, 1e-8 * rows + noise)
            if k.startswith("scale") and (left[k] & ~good).any():
                try:
                    near |= {j: make(j * h) for j in (-4, -3, 3, 4) if j not in near}
                except ModelError as error:
                    refused = error
                else:
                    f = {j: near[j][k] for j in near} | {0: base[k]}
                    good |= _between(d, f, h, 1e-6 * rows + 10.0 * noise)
            left[k] &= ~good
    if not tried:
        assert refused is not None
        raise refused
    for k, x in left.items():
        if x.any():
            yield f"{k}{np.argwhere(x)[0]}: {exact[k].imag[x][0] / STEP} for {tried[k][x][0]}"


def errors_of(s: Structure, name: str, size: float) -> list[str]:
    """Tables of which the complex step of a parameter does not give the derivative.

    Raises
    ------
    ModelError
        If the mechanism allows no change of this parameter.
    """
    value = s.model.environment()[name]

    def changed(change: float) -> Tables:
        """As complex numbers, whose sense is not examined: a damping of zero is changed both ways."""
        return {k: x.real for k, x in tables(values(s, {name: complex(value + change)})).items()}

    base = s.cache.get("tables as they stand", None, 1, lambda: changed(0.0))  # the same by whichever parameter
    return list(compared(changed, base, complex_tables(s, name), size))


def largest(a: np.ndarray) -> Any:
    """The largest size in each row of a table."""
    return np.abs(a).max(axis=-1, keepdims=True, initial=0.0)


def _near(a: np.ndarray, b: np.ndarray, relative: float, absolute: Any) -> np.ndarray:
    return np.abs(a - b) <= relative * np.abs(b) + absolute


def _between(d: np.ndarray, f: dict[int, np.ndarray], h: float, tolerance: Any) -> np.ndarray:
    """Whether a slope is between those to the left and to the right."""
    sides = [
        (-25.0 * f[0] + 48.0 * f[w] - 36.0 * f[2 * w] + 16.0 * f[3 * w] - 3.0 * f[4 * w]) / (12.0 * w * h)
        for w in (1, -1)
    ]
    return (np.minimum(*sides) - tolerance <= d) & (d <= np.maximum(*sides) + tolerance)
