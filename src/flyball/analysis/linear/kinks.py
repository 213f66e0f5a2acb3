"""Forces whose slope, or value, is another on the other side of where the mechanism is: a rope at its free length,
``abs`` at zero, a table's corner.

A law is followed a little way to both sides of every quantity that it depends on, and a tenth of that way. What differs
by as much at a tenth has a kink or a jump there; what is smooth differs by a tenth. The slopes on two sides of a kink
differ across it only (Hadamard), so their difference says in which direction it lies.
Slopes that grow from the one place to the nearer one are infinite between them: sqrt(abs(x)) at zero.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ...equations.loads import wide
from ...errors import SingularityError
from ...model.element import LawOf, fields_with
from ...model.expressions import Expression
from ...model.force import CoordinateForce
from ...model.model import Model
from .curves import gradients, snapshot
from .derivatives import STEP, Equations
from .loads import derivative

BESIDE = 1e-6  # the little way: of the mechanism's length, a radian, or these in a second
TENTH = 0.1
AS_MUCH = 0.5  # of the difference that far away
ROUNDED = 16.0 * np.finfo(float).eps
FLAT = 1e-7  # differences of slopes below this part of them are none

GROWS = 1.1  # what slopes to both sides grow by over the last nine tenths of the way, if the slope is infinite
KINK, JUMP, STEEP, NO_VALUE = "has a kink", "jumps", "has an infinite slope", "has no value or no slope"

Law = Callable[[np.ndarray], complex]


@dataclass(frozen=True)
class Kink:
    """Where a force or a driver's law has two slopes, or none.

    Attributes
    ----------
    element : str
    text : str
        What has it, and where, in words.
    jump : bool
        Whether the value too is another on the other side, or there is none.
    along : ndarray (nv,), (nv,)
        How what decides changes with positions and velocities.
    by_parameter : bool
        Whether it changes with a parameter that was asked for.
    """

    element: str
    text: str
    jump: bool
    along: tuple[np.ndarray, np.ndarray]
    by_parameter: bool

    def felt(self, dq: np.ndarray | None, dv: np.ndarray | None) -> bool:
        """Whether any of some changes of positions and velocities leads across it, (nv, n) each; any at all if None."""
        if dq is None or dv is None:
            return self.by_parameter or bool(np.any(self.along))
        ways = np.abs(self.along[0]) @ np.abs(dq) + np.abs(self.along[1]) @ np.abs(dv)
        moved = np.abs(self.along[0] @ dq + self.along[1] @ dv)
        return self.by_parameter or bool((moved > FLAT * ways).any())


def refuse_kinks(
    e: Equations, dq: np.ndarray | None = None, dv: np.ndarray | None = None, to: Sequence[str] = ()
) -> None:
    """Refuse a state where a force has no slope along changes of positions and velocities, or by a parameter.

    Parameters
    ----------
    e : Equations
    dq, dv : ndarray (nv, n)
        Any at all if not given.
    to : sequence of str
        Parameters.

    Raises
    ------
    SingularityError
        Naming the elements and what they decide by.
    """
    found = [k for k in kinks(e, to) if k.felt(dq, dv)]
    if found:
        raise refused(found, e.state.t, "there are no linear equations")


def refused(found: Sequence[Kink], t: float, so: str) -> SingularityError:
    """The error that tells of kinks."""
    texts = "; ".join(dict.fromkeys(k.text for k in found))
    return SingularityError(
        f"{texts}. What is so on one side only says nothing of the other, so {so}. Move the mechanism away from there, "
        f"or write what is smooth: sqrt(x**2 + w**2) for abs(x), tanh(x/w) for sign(x), step(x, x0, y0, x1, y1), a "
        f"table with interpolation 'cubic'",
        t,
        tuple(dict.fromkeys(k.element for k in found)),
    )


def kinks(e: Equations, to: Sequence[str] = ()) -> list[Kink]:
    """All kinks and jumps of forces and drivers at a state.

    Parameters
    ----------
    e : Equations
    to : sequence of str
        Parameters that laws are followed along too.
    """
    out: list[Kink] = []
    shot = None
    for element, text, names, law in _laws(e, to):
        shot = shot or snapshot(e.state)
        values = [("", np.array([_parameter(e, n)])) if n in to else shot.curve(n) for n in names]
        at = np.array([float(v[0]) for _, v in values])
        sizes = np.array([e.state.c.values.length if unit.startswith("m") else 1.0 for unit, _ in values])
        for normal, what in across(law, at, sizes):
            out.append(_told(e, element, text, [*zip(names, at, values, strict=True)], normal, what, to))
    return out


def across(law: Law, at: np.ndarray, sizes: np.ndarray) -> list[tuple[np.ndarray, str]]:
    """Kinks of a function of several quantities at a place: (direction that leads across, what it has there)."""
    out: list[tuple[np.ndarray, str]] = []
    for i, size in enumerate(sizes.tolist()):
        step = np.zeros(len(at))
        step[i] = BESIDE * size
        far, near = (Beside.of(law, at, part * step, sizes) for part in (1.0, TENTH))
        rounding = ROUNDED * near.slope * (BESIDE + float(np.abs(at / sizes).max()))  # of terms that cancel
        jump = near.jump > max(AS_MUCH * far.jump, FLAT * near.value) and near.jump > rounding
        kink = near.bend > max(AS_MUCH * far.bend, FLAT * near.slope)
        known = np.isfinite([near.value, near.slope])
        if known.all() and not jump and not kink:
            continue
        steep = near.steepest > GROWS * far.steepest
        what = NO_VALUE if not known.all() else JUMP if jump else STEEP if steep else KINK
        normal = near.across if what == KINK and np.abs(near.across).max() > FLAT * near.slope else step / size
        normal = normal / np.linalg.norm(normal)
        if not any(what == w and abs(abs(normal @ n) - 1.0) < FLAT**0.5 for n, w in out):
            out.append((normal, what))
    if not any(what != KINK for _, what in out):
        between = faces(
            lambda step: _value(law, at + sizes * step, sizes), len(at), BESIDE, TENTH * BESIDE, AS_MUCH, FLAT
        )
        out += [(n, KINK) for n in between if not any(abs(abs(n @ m) - 1.0) < FLAT**0.5 for m, _ in out)]
    return out


@dataclass(frozen=True)
class Beside:
    """What differs between a place and its two sides, slopes in units of the sizes.

    ``jump`` of the value, ``bend`` of the slopes, ``across``: by what the slopes of one side exceed those of the other;
    ``value`` and ``slope`` are how large these are, ``steepest`` the latter at the two sides.
    """

    jump: float
    bend: float
    across: np.ndarray
    value: float
    slope: float
    steepest: float

    @classmethod
    def of(cls, law: Law, at: np.ndarray, step: np.ndarray, sizes: np.ndarray) -> Beside:
        """To both sides of a place by a step."""
        (f, df), (g, dg), (h, dh) = (_value(law, at + way, sizes) for way in (step, -step, 0.0 * step))
        middle = 0.5 * (f + g) - h, 0.5 * (df + dg) - dh
        return cls(
            max(abs(f - g), abs(middle[0])),
            float(max(np.abs(df - dg).max(), np.abs(middle[1]).max())),
            df - dg,
            float(np.max(np.abs([f, g, h]))),  # nan if any is
            float(np.max(np.abs([df, dg, dh]))),
            float(np.max(np.abs([df, dg]))),
        )


def _value(law: Law, at: np.ndarray, sizes: np.ndarray) -> tuple[float, np.ndarray]:
    """A law's value and slopes in units of the sizes."""
    steps = 1j * STEP * np.diag(sizes)
    with np.errstate(all="ignore"):
        found = np.array([law(at + step) for step in steps])
    return float(found[0].real), derivative(found)


def _laws(e: Equations, to: Sequence[str]) -> Iterator[tuple[str, str, list[str], Law]]:
    """Forces and drivers as functions: (element, its title and law, names of what it depends on, the function)."""
    c = e.state.c
    s = c.structure
    known = {name: complex(value) for name, value in s.model.environment(c.parameters).items()}
    known["t"] = complex(e.state.t)
    tables = {x.name: x for x in s.model.tables}
    for d in s.model.drivers:
        of = LawOf(s.model.unit(d.coordinate, d))
        law = s.model.law(d.law, of, d.title, driver=True)
        if names := _names(s.model, law, {}, to):
            yield d.name, f"{d.title}: its law '{law}'", [*names.values()], partial(_law, law, [*names], known, tables)
    for k, force in enumerate(s.forces):
        inputs: dict[str, str] = {}
        laws: list[Expression] = []
        for field, of in fields_with(force.__class__, LawOf).items():
            value = getattr(force, field)
            inputs = {name: f"{force.name}.{name}" for name in of.inputs}
            for part in value if isinstance(value, tuple) else (value,):
                if part is not None:
                    laws.append(s.model.law(part, of, force.title))
        if isinstance(force, CoordinateForce):
            law = laws[0] if laws else Expression.constant(0.0)
            both = [f"{force.name}.{name}" for name in [*force.outputs][:2]]
            names = dict(zip([*inputs] or ["value", "rate"], both, strict=True))
            names |= {n: c for n, c in _names(s.model, law, inputs, to).items() if n not in inputs}
            text = f"{force.title}: its law '{law}'" if laws else force.title
            par = wide(c.values.system.force_parameters, k)
            yield force.name, text, [*names.values()], partial(_effort, force, par, law, [*names], known, tables)
            continue
        for law in laws:
            if names := _names(s.model, law, inputs, to):
                text = f"{force.title}: its law '{law}'"
                yield force.name, text, [*names.values()], partial(_law, law, [*names], known, tables)


def _names(model: Model, law: Expression, inputs: dict[str, str], to: Sequence[str]) -> dict[str, str]:
    """What a law depends on besides time: its names for it, and the curves' (a parameter's is its own)."""
    sensors = {x.name: f"{x.name}.value" for x in model.sensors}
    curves = sensors | inputs | {name: name for name in (*to, *law.names) if name in to or "." in name}
    return {name: curves[name] for name in sorted(law.names) if name in curves}


def _law(law: Expression, names: list[str], known: dict[str, complex], tables: dict, x: np.ndarray) -> complex:
    try:
        return complex(law.evaluate(known | dict(zip(names, x.tolist(), strict=True)), tables))
    except ArithmeticError:
        return complex(np.nan, np.nan)


def _effort(
    force: CoordinateForce, par: tuple, law: Expression, names: list[str], known: dict, tables: dict, x: np.ndarray
) -> complex:
    """The effort of a force along a coordinate; its first two names are the coordinate and its rate."""
    o = 0.0 * x[0]
    return complex(force.effort(par, x[0], x[1], (_law(law, names, known, tables, x), o, o), o))


def _parameter(e: Equations, name: str) -> float:
    return float(e.state.c.structure.model.environment(e.state.c.parameters)[name])


def _told(
    e: Equations, element: str, text: str, at: Sequence[tuple[str, float, tuple]], normal: np.ndarray, what: str,
    to: Sequence[str],
) -> Kink:  # fmt: skip
    x, nv = e.state, len(e.state.v)
    curves = [name for name, _, _ in at if name not in to]
    sizes = np.array([x.c.values.length if unit.startswith("m") else 1.0 for _, _, (unit, _) in at])
    weights = np.array([normal[k] / sizes[k] for k, (name, _, _) in enumerate(at) if name not in to])
    by_all = gradients(x, curves).T @ weights
    along = by_all[:nv], by_all[nv : 2 * nv]
    where = ", ".join(
        f"{name} = {value + 0.0:.6g} {unit}".strip()
        for (name, value, (unit, _)), n in zip(at, normal, strict=True)
        if abs(n) > FLAT
    )
    by = any(name in to and abs(n) > FLAT for (name, _, _), n in zip(at, normal, strict=True))
    return Kink(element, f"{text} {what} at {where}", what not in (KINK, STEEP), along, by)


# Kinks that meet in a place: the pieces of a function around it, seen from it in many directions.
#
# Along its quantities one by one a function may be smooth where it has kinks between them: max(0, min(x, y)). So it is
# looked at a little way off in directions all around. Across a face between two pieces of a continuous function slopes
# differ along the face's normal only (Hadamard), so the faces are found where, on the way from a direction in one piece
# to one in another, the slopes change.


AROUND = 13  # directions around a place in a plane; odd, so that no two are opposite
EACH = 12  # directions for each of more quantities than two
TURNED = 0.123  # angle of the first: faces are seldom there
HALVED = 12  # times that the way between two pieces is parted
PIECES = 8  # at most that are told apart

Slopes = Callable[[np.ndarray], tuple[float, np.ndarray]]  # value and slopes a scaled step from the place


class Piece:
    """A direction (n,), and value and slopes far and near along it."""

    def __init__(self, of: Slopes, way: np.ndarray, far: float, near: float, same: float, flat: float) -> None:
        self.of, self.sizes, self.way, self.same, self.flat = of, (far, near), way / np.linalg.norm(way), same, flat

    @cached_property
    def far(self) -> np.ndarray:
        """Slopes far away, (n,)."""
        return self.of(self.sizes[0] * self.way)[1]

    @cached_property
    def near(self) -> np.ndarray:
        """Slopes near the place, (n,)."""
        return self.of(self.sizes[1] * self.way)[1]

    def across(self, other: Piece) -> np.ndarray | None:
        """By what the slopes of another exceed these, (n,); None if they are of one piece."""
        near = other.near - self.near
        size = max(np.abs(self.near).max(), np.abs(other.near).max())
        if not np.abs(near).max() > self.flat * size:
            return None
        return near if np.abs(near).max() > self.same * np.abs(other.far - self.far).max() else None

    def to(self, other: Piece, part: float) -> Piece:
        """A direction between the two."""
        return Piece(self.of, (1.0 - part) * self.way + part * other.way, *self.sizes, self.same, self.flat)


def faces(of: Slopes, n: int, far: float, near: float, same: float, flat: float) -> list[np.ndarray]:
    """Normals (n,) of the faces between the pieces around a place.

    Parameters
    ----------
    of : callable
        Value and slopes a step away, in units of the sizes.
    n : int
        Quantities.
    far, near : float
        Two lengths of steps.
    same : float
        Slopes that differ near by less than this part of what they differ by far away are of one smooth piece.
    flat : float
        The same, of the slopes themselves.
    """
    found: list[Piece] = []
    for way in _around(n):
        other = Piece(of, way, far, near, same, flat)
        if len(found) <= PIECES and all(known.across(other) is not None for known in found):
            found.append(other)
    if len(found) > PIECES:  # slopes that change all around, as those of a cone do
        return list(np.eye(n))
    out: list[np.ndarray] = []
    for a, b in itertools.combinations(found, 2):
        for normal in _between(a, b, HALVED):
            normal = normal / np.linalg.norm(normal)
            if not any(abs(abs(normal @ m) - 1.0) < flat**0.5 for m in out):
                out.append(normal)
    return out


def _around(n: int) -> np.ndarray:
    """Directions of n quantities, evenly around in a plane, else at random."""
    if n < 2:
        return np.zeros((0, n))
    if n > 2:
        return np.random.default_rng(0).standard_normal((EACH * n, n))
    angle = TURNED + 2.0 * np.pi * np.arange(AROUND) / AROUND
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _between(a: Piece, b: Piece, halvings: int) -> list[np.ndarray]:
    """Differences of the slopes of all pieces that are passed on the way from one to another."""
    across = a.across(b)
    if across is None:
        return []
    if not halvings:
        return [across]
    middle = a.to(b, 0.4375)  # not where a face is likely to be
    return _between(a, middle, halvings - 1) + _between(middle, b, halvings - 1)
