"""Nonsmooth points of forces and of rates of controller states: kinks, jumps and infinite slopes at the present state.

Examples are a rope at its free length, ``abs`` at zero and the corner of a table. A law is evaluated at a small offset
on both sides of every quantity that it depends on, and at a tenth of that offset. A difference between the sides that
stays the same at a tenth of the offset is a kink or a jump; in a smooth law it shrinks to a tenth. Across a kink the
slopes change only in the direction normal to it (Hadamard), so their difference gives the normal. Slopes that grow
towards the point are infinite there, such as those of sqrt(abs(x)) at zero. Kinks that meet in a point, as in
max(0, min(x, y)), are found from slopes in many directions around it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism
from ..engine.loads import force_row
from ..errors import SingularityError
from ..model.element import LawOf, fields_with
from ..model.expressions import Expression
from ..model.force import CoordinateForce
from ..model.model import Model
from ..model.names import is_curve
from .equation_derivatives import COMPLEX_STEP, EquationDerivatives, complex_step_derivative, state_sizes
from .output_derivatives import curve_gradients, snapshot

OFFSET = 1e-6  # relative to the mechanism's length or a radian, or to these times its characteristic rate
NEAR_FRACTION = 0.1
PERSISTENT_FRACTION = 0.5  # of the difference at the full offset
LAW_ROUNDING = 16.0 * np.finfo(float).eps
SLOPE_TOLERANCE = 1e-7  # relative difference of slopes that counts as zero

# A slope is infinite if it grows by this factor from the full offset to a tenth of it.
STEEPENING = 1.1
KINK, JUMP, STEEP, NO_VALUE = "has a kink", "jumps", "has an infinite slope", "has no value or no slope"

LawFunction = Callable[[np.ndarray], complex]


@dataclass(frozen=True)
class NonsmoothPoint:
    """Point where the law of a force, driver or controller has two different slopes, or none.

    Attributes
    ----------
    element : str
    text : str
        Description of the law and of the point.
    jump : bool
        Whether the value itself is discontinuous or undefined.
    along : ndarray (nv,), (nv,), (nz,)
        Gradient, by positions, velocities and controller states, of the quantity in which the law is not smooth.
    by_parameter : bool
        Whether that quantity depends on a requested parameter.
    """

    element: str
    text: str
    jump: bool
    along: tuple[np.ndarray, np.ndarray, np.ndarray]
    by_parameter: bool

    def is_crossed_by(self, *changes: np.ndarray) -> bool:
        """Whether any of n changes leads across the point.

        The changes are those of positions (nv, n), velocities (nv, n) and, if given, controller states (nz, n). Without
        any: whether any change at all does.
        """
        if not changes:
            return self.by_parameter or any(np.any(part) for part in self.along)
        pairs = list(zip(self.along, changes, strict=False))
        ways = sum(np.abs(part) @ np.abs(d) for part, d in pairs)
        moved = np.abs(sum(part @ d for part, d in pairs))
        return self.by_parameter or bool((moved > SLOPE_TOLERANCE * ways).any())


def refuse_nonsmooth(e: EquationDerivatives, *changes: np.ndarray, to: Sequence[str] = ()) -> None:
    """Refuse a state where a force or rate has no derivative along given changes of state, or by a parameter.

    Parameters
    ----------
    e : EquationDerivatives
    *changes : ndarray
        Changes of the state, as of `NonsmoothPoint.is_crossed_by`; any change if not given.
    to : sequence of str
        Parameters.

    Raises
    ------
    SingularityError
        With the names of the elements and the quantities in which they are not smooth.
    """
    found = [k for k in nonsmooth_points(e, to) if k.is_crossed_by(*changes)]
    if found:
        raise nonsmooth_error(found, e.state.t, "there are no linear equations")


def nonsmooth_error(found: Sequence[NonsmoothPoint], t: float, so: str) -> SingularityError:
    """The error that describes nonsmooth points."""
    texts = "; ".join(dict.fromkeys(k.text for k in found))
    return SingularityError(
        f"{texts}. Derivatives on one side of such a point do not apply on the other, so {so}. Choose another "
        "position, or a smooth law: sqrt(x**2 + w**2) for abs(x), tanh(x/w) for sign(x), step(x, x0, y0, x1, y1), a "
        "table with interpolation 'cubic'",
        t,
        tuple(dict.fromkeys(k.element for k in found)),
    )


def nonsmooth_points(e: EquationDerivatives, to: Sequence[str] = ()) -> list[NonsmoothPoint]:
    """Find all kinks and jumps of forces, drivers and rates of controller states at a state.

    Parameters
    ----------
    e : EquationDerivatives
    to : sequence of str
        Parameters that count as arguments of the laws, too.
    """
    states = [x.name for x in e.state.c.structure.controls]
    out: list[NonsmoothPoint] = []
    shot = None
    for element, text, names, law in (*_force_and_driver_functions(e, to), *_controller_functions(e, to)):
        shot = shot or snapshot(e.state)
        values = [("", np.array([_parameter_value(e, n)])) if n in to else shot.curve(n) for n in names]
        at = np.array([float(v[0]) for _, v in values])
        sizes = np.array([_natural_size(e.state.c, unit) for unit, _ in values])
        for k, name in enumerate(names):
            if name in states:
                sizes[k] = state_sizes(e).change[states.index(name)]
            elif name in to:
                sizes[k] = abs(at[k]) or 1.0
        of = [*zip(names, at, values, sizes.tolist(), strict=True)]
        out += [_nonsmooth_point(e, element, text, of, *k, to) for k in nonsmooth_directions(law, at, sizes)]
    return out


def _natural_size(c: CompiledMechanism, unit: str) -> float:
    """Size of a quantity with that unit: the mechanism's length or 1, times its rate for velocities."""
    return (c.values.length if unit.startswith("m") else 1.0) * (float(c.work.options.rate) if "/s" in unit else 1.0)


def nonsmooth_directions(law: LawFunction, at: np.ndarray, sizes: np.ndarray) -> list[tuple[np.ndarray, str]]:
    """Kinks of a function of several quantities at a point: (direction across the kink, its kind)."""
    out: list[tuple[np.ndarray, str]] = []
    for i, size in enumerate(sizes.tolist()):
        step = np.zeros(len(at))
        step[i] = OFFSET * size
        far, near = (OneSidedDifferences.of(law, at, part * step, sizes) for part in (1.0, NEAR_FRACTION))
        rounding = LAW_ROUNDING * near.slope * (OFFSET + float(np.abs(at / sizes).max()))  # of terms that cancel
        jump = near.jump > max(PERSISTENT_FRACTION * far.jump, SLOPE_TOLERANCE * near.value) and near.jump > rounding
        kink = near.bend > max(PERSISTENT_FRACTION * far.bend, SLOPE_TOLERANCE * near.slope)
        known = np.isfinite([near.value, near.slope])
        if known.all() and not jump and not kink:
            continue
        steep = near.steepest > STEEPENING * far.steepest
        what = NO_VALUE if not known.all() else JUMP if jump else STEEP if steep else KINK
        normal = (
            near.across if what == KINK and np.abs(near.across).max() > SLOPE_TOLERANCE * near.slope else step / size
        )
        normal = normal / np.linalg.norm(normal)
        if not any(what == w and abs(abs(normal @ n) - 1.0) < SLOPE_TOLERANCE**0.5 for n, w in out):
            out.append((normal, what))
    if not any(what != KINK for _, what in out):
        between = face_normals(
            lambda step: _value_and_slopes(law, at + sizes * step, sizes),
            len(at),
            OFFSET,
            NEAR_FRACTION * OFFSET,
            PERSISTENT_FRACTION,
            SLOPE_TOLERANCE,
        )
        out += [(n, KINK) for n in between if not any(abs(abs(n @ m) - 1.0) < SLOPE_TOLERANCE**0.5 for m, _ in out)]
    return out


@dataclass(frozen=True)
class OneSidedDifferences:
    """Differences of a law between a point and its two sides; slopes in units of the sizes.

    ``jump`` is that of the value, ``bend`` that of the slopes, ``across`` (n,) the slopes of one side minus those of
    the other. ``value`` and ``slope`` are the largest magnitudes, ``steepest`` is the largest slope at the two sides.
    """

    jump: float
    bend: float
    across: np.ndarray
    value: float
    slope: float
    steepest: float

    @classmethod
    def of(cls, law: LawFunction, at: np.ndarray, step: np.ndarray, sizes: np.ndarray) -> OneSidedDifferences:
        """Differences at a point for one step to both sides."""
        (f, df), (g, dg), (h, dh) = (_value_and_slopes(law, at + way, sizes) for way in (step, -step, 0.0 * step))
        middle = 0.5 * (f + g) - h, 0.5 * (df + dg) - dh
        return cls(
            max(abs(f - g), abs(middle[0])),
            float(max(np.abs(df - dg).max(), np.abs(middle[1]).max())),
            df - dg,
            float(np.max(np.abs([f, g, h]))),  # NaN if any of them is NaN
            float(np.max(np.abs([df, dg, dh]))),
            float(np.max(np.abs([df, dg]))),
        )


def _value_and_slopes(law: LawFunction, at: np.ndarray, sizes: np.ndarray) -> tuple[float, np.ndarray]:
    """Value of a law, and its slopes in units of the sizes."""
    steps = 1j * COMPLEX_STEP * np.diag(sizes)
    with np.errstate(all="ignore"):
        found = np.array([law(at + step) for step in steps])
    return float(found[0].real), complex_step_derivative(found)


def _force_and_driver_functions(
    e: EquationDerivatives, to: Sequence[str]
) -> Iterator[tuple[str, str, list[str], LawFunction]]:
    """Yield the laws of forces and drivers: (element, title and law, names of the arguments, function)."""
    c = e.state.c
    s = c.structure
    known, tables = _known_values(e)
    for d in s.model.drivers:
        of = LawOf(s.model.unit(d.coordinate, d))
        law = s.model.law(d.law, of, d.title, driver=True)
        if names := _law_arguments(s.model, law, {}, to):
            yield (
                d.name,
                f"{d.title}: its law '{law}'",
                [*names.values()],
                partial(_law_value, law, [*names], known, tables),
            )
    for coupling in s.model.couplings:
        law = coupling.equation(s.model)
        if law is not None and (names := _law_arguments(s.model, law, {}, to)):
            value = partial(_law_value, law, [*names], known, tables)
            yield coupling.name, f"{coupling.title}: its law '{law}'", [*names.values()], value
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
            names |= {n: c for n, c in _law_arguments(s.model, law, inputs, to).items() if n not in inputs}
            text = f"{force.title}: its law '{law}'" if laws else force.title
            par = force_row(c.values.system.force_parameters, k)
            yield force.name, text, [*names.values()], partial(_effort_value, force, par, law, [*names], known, tables)
            continue
        for law in laws:
            if names := _law_arguments(s.model, law, inputs, to):
                text = f"{force.title}: its law '{law}'"
                yield force.name, text, [*names.values()], partial(_law_value, law, [*names], known, tables)


def _known_values(e: EquationDerivatives) -> tuple[dict[str, complex], dict]:
    """Parameters and time, and the tables of the model, by name."""
    model = e.state.c.structure.model
    known = {name: complex(value) for name, value in model.environment(e.state.c.parameters).items()}
    return known | {"t": complex(e.state.t)}, model.law_tables()


def _controller_functions(
    e: EquationDerivatives, to: Sequence[str]
) -> Iterator[tuple[str, str, list[str], LawFunction]]:
    """Yield the laws of the controller states, as `_force_and_driver_functions`."""
    known, tables = _known_values(e)
    for x in e.state.c.structure.controls:
        if names := _law_arguments(e.state.c.structure.model, x.law, {}, to):
            text = f"the law of {x.name!r}: '{x.controller.given().get(x.law.text, x.law.text)}'"
            law = partial(_law_value, x.law, [*names], known, tables)
            yield x.controller.name, text, [*names.values()], law


def _law_arguments(model: Model, law: Expression, inputs: dict[str, str], to: Sequence[str]) -> dict[str, str]:
    """Arguments of a law besides time: name in the law -> curve (a parameter stands for itself)."""
    sensors = {x.name: f"{x.name}.value" for x in model.sensors}
    curves = sensors | inputs | {name: name for name in (*to, *law.names) if name in to or is_curve(model, name)}
    return {name: curves[name] for name in sorted(law.names) if name in curves}


def _law_value(law: Expression, names: list[str], known: dict[str, complex], tables: dict, x: np.ndarray) -> complex:
    try:
        return complex(law.evaluate(known | dict(zip(names, x.tolist(), strict=True)), tables))
    except ArithmeticError:
        return complex(np.nan, np.nan)


def _effort_value(
    force: CoordinateForce, par: tuple, law: Expression, names: list[str], known: dict, tables: dict, x: np.ndarray
) -> complex:
    """Effort of a force along a coordinate; its first two arguments are the coordinate and its rate."""
    o = 0.0 * x[0]
    return complex(force.effort(par, x[0], x[1], (_law_value(law, names, known, tables, x), o, o), o))


def _parameter_value(e: EquationDerivatives, name: str) -> float:
    return float(e.state.c.structure.model.environment(e.state.c.parameters)[name])


def _nonsmooth_point(
    e: EquationDerivatives,
    element: str,
    text: str,
    at: Sequence[tuple[str, float, tuple, float]],
    normal: np.ndarray,
    what: str,
    to: Sequence[str],
) -> NonsmoothPoint:
    x, nv = e.state, len(e.state.v)
    curves = [name for name, *_ in at if name not in to]
    weights = np.array([normal[k] / size for k, (name, _, _, size) in enumerate(at) if name not in to])
    by_all = curve_gradients(x, curves).T @ weights
    along = by_all[:nv], by_all[nv : 2 * nv], by_all[len(by_all) - e.nz :]
    where = ", ".join(
        f"{name} = {value + 0.0:.6g} {unit}".strip()
        for (name, value, (unit, _), _), n in zip(at, normal, strict=True)
        if abs(n) > SLOPE_TOLERANCE
    )
    by = any(name in to and abs(n) > SLOPE_TOLERANCE for (name, *_), n in zip(at, normal, strict=True))
    return NonsmoothPoint(element, f"{text} {what} at {where}", what not in (KINK, STEEP), along, by)


# Kinks that meet in a point: directions around the point find the smooth pieces of the function.
#
# A function can be smooth along each of its quantities and have kinks between them: max(0, min(x, y)). It is therefore
# sampled at a small distance in directions all around the point. Across a face between two pieces of a continuous
# function the slopes differ along the face's normal only (Hadamard). Two directions whose slopes differ lie in
# different pieces; bisection between them finds the faces.


PLANE_DIRECTIONS = 13  # directions around a point in a plane; odd, so that no two are opposite
DIRECTIONS_PER_QUANTITY = 12  # directions per quantity, for more than two quantities
FIRST_ANGLE = 0.123  # angle [rad] of the first direction: faces are seldom there
MAX_HALVINGS = 12  # bisections between two directions
MAX_SMOOTH_REGIONS = 8  # largest number of smooth pieces

ValueAndSlopes = Callable[[np.ndarray], tuple[float, np.ndarray]]  # value and slopes a scaled step from the place


class SmoothPiece:
    """A direction (n,), with the value and slopes at a far and a near point along it."""

    def __init__(self, of: ValueAndSlopes, way: np.ndarray, far: float, near: float, same: float, flat: float) -> None:
        self.of, self.sizes, self.way, self.same, self.flat = of, (far, near), way / np.linalg.norm(way), same, flat

    @cached_property
    def far(self) -> np.ndarray:
        """Slopes at the far point, (n,)."""
        return self.of(self.sizes[0] * self.way)[1]

    @cached_property
    def near(self) -> np.ndarray:
        """Slopes at the near point, (n,)."""
        return self.of(self.sizes[1] * self.way)[1]

    def across(self, other: SmoothPiece) -> np.ndarray | None:
        """Slopes of another direction minus these, (n,); None if both lie in one smooth piece."""
        near = other.near - self.near
        size = max(np.abs(self.near).max(), np.abs(other.near).max())
        if not np.abs(near).max() > self.flat * size:
            return None
        return near if np.abs(near).max() > self.same * np.abs(other.far - self.far).max() else None

    def to(self, other: SmoothPiece, part: float) -> SmoothPiece:
        """A direction between the two, a fraction ``part`` of the way."""
        return SmoothPiece(self.of, (1.0 - part) * self.way + part * other.way, *self.sizes, self.same, self.flat)


def face_normals(of: ValueAndSlopes, n: int, far: float, near: float, same: float, flat: float) -> list[np.ndarray]:
    """Normals (n,) of the faces between the smooth pieces around a point.

    Parameters
    ----------
    of : callable
        Value and slopes at a step from the point, in units of the sizes.
    n : int
        Number of quantities.
    far, near : float
        Two lengths of steps.
    same : float
        Two directions lie in one piece if their slopes differ at the near step by less than this part of their
        difference at the far step.
    flat : float
        The same limit, relative to the slopes themselves.
    """
    found: list[SmoothPiece] = []
    for way in _directions_around(n):
        other = SmoothPiece(of, way, far, near, same, flat)
        if len(found) <= MAX_SMOOTH_REGIONS and all(known.across(other) is not None for known in found):
            found.append(other)
    if len(found) > MAX_SMOOTH_REGIONS:  # slopes change everywhere, as on a cone
        return list(np.eye(n))
    out: list[np.ndarray] = []
    for a, b in itertools.combinations(found, 2):
        for normal in _slope_differences_between(a, b, MAX_HALVINGS):
            normal = normal / np.linalg.norm(normal)
            if not any(abs(abs(normal @ m) - 1.0) < flat**0.5 for m in out):
                out.append(normal)
    return out


def _directions_around(n: int) -> np.ndarray:
    """Directions of n quantities: evenly spaced in a plane, random in more dimensions."""
    if n < 2:
        return np.zeros((0, n))
    if n > 2:
        return np.random.default_rng(0).standard_normal((DIRECTIONS_PER_QUANTITY * n, n))
    angle = FIRST_ANGLE + 2.0 * np.pi * np.arange(PLANE_DIRECTIONS) / PLANE_DIRECTIONS
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _slope_differences_between(a: SmoothPiece, b: SmoothPiece, halvings: int) -> list[np.ndarray]:
    """Differences of slopes across all faces between two directions."""
    across = a.across(b)
    if across is None:
        return []
    if not halvings:
        return [across]
    middle = a.to(b, 0.4375)  # not where a face is likely to be
    return _slope_differences_between(a, middle, halvings - 1) + _slope_differences_between(middle, b, halvings - 1)
