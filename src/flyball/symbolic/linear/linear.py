"""Linear equations about a point, as expressions of the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.linear.instant import instant
from ...errors import ModelError
from ...graph.derivative import replaced
from ...model.model import Model
from ...results.equilibrium import Equilibrium
from ...results.result import Result
from ...tables.spanning import spanning
from .balance import balanced, conditions, multipliers, refuse_unbalanced, varying
from .derivatives import Derivatives
from .equations import LinearEquations
from .free import free
from .matrices import matrices
from .point import Point, drawn, given
from .reduced import reduced
from .solve import number
from .steady import refuse_singular, refuse_unsteady
from .traced import Mechanics, mechanics, refuse_unknown
from .validity import Validity

STILL = 1e-12  # [1/s]: slower is rounding


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What `linear_equations` is asked; see there."""

    inputs: Sequence[str] = ()
    outputs: Sequence[str] = ()
    at: Equilibrium | Result | Mapping[str, Any] | None = None
    coordinates: str = "joint"
    independent: Sequence[str] = ()
    balanced_by: Sequence[str] = ()
    parameters: Mapping[str, float] | None = None
    tree: Sequence[str] | None = None  # the tree joints, where they are known


def linear_equations(
    model: Model,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    *,
    at: Equilibrium | Result | Mapping[str, Any] | None = None,
    coordinates: str = "joint",
    independent: Sequence[str] = (),
    balanced_by: Sequence[str] = (),
    parameters: Mapping[str, float] | None = None,
) -> LinearEquations:
    """Linear equations x' = A x + B u, y = C x + D u with the parameters as symbols.

    About an equilibrium, or a motion in which coordinates of joints turn evenly while all others stand still.

    Parameters
    ----------
    inputs, outputs : sequence of str
        As of `Mechanism.linearize`.
    at : Equilibrium, Result or mapping, optional
        Where. As drawn, if not given: then coordinates are the expressions by which the mechanism is drawn. A mapping
        gives coordinates, and as ``"A.angle rate"`` their rates: numbers, texts with a unit, expressions of parameters;
        what it does not give is as drawn, or moved so that loops close. Of an equilibrium, or the end of a motion, the
        coordinates are numbers.
    coordinates : {"joint", "absolute"}
        Those that the equations are made in.
    independent : sequence of str
        Coordinates that the states are changes of; chosen by pivoting if not given.
    balanced_by : sequence of str
        Parameters that take the values with which the point is an equilibrium, as many as there are conditions.
    parameters : mapping, optional
        Values in place of the model's own, in SI units or with a unit.

    Raises
    ------
    ModelError
        If a name does not exist, the point cannot be closed, is singular or no equilibrium, or something moves without
        inertia.
    AnalysisError
        If the linear equations change with time, or an output follows the rate of an input.
    """
    if coordinates not in ("joint", "absolute"):
        raise ModelError(f"unknown coordinates {coordinates!r}; choose one of joint, absolute")
    asked = Asked(
        inputs=inputs, outputs=outputs, at=at, coordinates=coordinates, independent=independent,
        balanced_by=balanced_by, parameters=parameters,
    )  # fmt: skip
    return about(model, asked)


def about(model: Model, o: Asked) -> LinearEquations:
    """As `linear_equations`."""
    refuse_unknown(model, o.outputs)
    m, point = _pointed(model, o)
    curves = [m.output(name) for name in o.outputs]
    d = Derivatives(m, [y for _, y in curves])
    where = point.replacing(m)
    first = d.at([*where, *((s, 0.0) for s in m.multipliers)])
    refuse_singular(m, [m.graph.node(x) for x in _by_velocity(d)], point)
    f = free(m, first, o.independent)
    lam = multipliers(m, point, f)
    at_rest = conditions(m, point, lam, f)
    pairs = balanced(m, at_rest, o.balanced_by) if o.balanced_by else []
    point = Point(replaced(point.q, pairs), replaced(point.v, pairs), point.z, point.t, point.found)
    lam[:] = replaced(list(lam), pairs)
    known = {s.data.name: number(x) for s, x in [*pairs, *zip(m.multipliers, lam, strict=True)]}
    refuse_unbalanced(m, f, first.by["rx"], point.numbers(m) | _at_rest(m) | known)
    where = [*point.replacing(m), *zip(m.multipliers, lam, strict=True)]
    p = d.at(where).replaced(pairs) if pairs else d.at(where)
    f = free(m, p, o.independent)
    refuse_unsteady(m, d, f, point, known)
    out = matrices(m, p, f, reduced(m, p, f), list(zip(o.outputs, (unit for unit, _ in curves), strict=True)))
    return LinearEquations(
        name=m.model.name,
        parameters={k: x.value for k, x in m.given.items() if x not in m.added and k not in dict(_names(pairs))},
        conditions=[] if pairs else at_rest,
        balanced_by=dict(_names(pairs)),
        found=point.found,
        at=p,
        free=f,
        mechanics=m,
        matrices=out,
        validity=Validity([] if pairs else at_rest, varying(replaced(list(m.g), where))),
    )


def _names(pairs: Sequence[tuple[Any, Any]]) -> list[tuple[str, Any]]:
    return [(s.data.name, x) for s, x in pairs]


def _by_velocity(d: Derivatives) -> list[Any]:
    """G, row by row."""
    rows = slice(*d.ends[2:4])
    columns = np.array([c[rows] for c in d.columns["v"]], object).reshape(len(d.m.x.v), -1)
    return list(columns.T.ravel())


def _at_rest(m: Mechanics) -> dict[str, float]:
    """Loads of joints with friction, which are no unknowns any more."""
    return {s.data.name: 0.0 for s in m.x.loads}


def _pointed(model: Model, o: Asked) -> tuple[Mechanics, Point]:
    """The mechanism traced in its coordinates, and the point."""
    if isinstance(o.at, Equilibrium | Result):
        if isinstance(o.at, Equilibrium) and o.at.preload:
            raise ModelError(
                "at is an equilibrium under a preload, which is no part of the mechanism: add it to its forces"
            )
        x, _ = instant(model, o.at, coordinates=o.coordinates, parameters=o.parameters)
        values = dict(x.c.parameters)
        m = mechanics(model, x.c.structure.tree, o.inputs, values)
        v = x.v if np.abs(x.v / x.c.sizes).max(initial=0.0) > STILL else 0.0 * x.v
        return m, Point(x.q.tolist(), v.tolist(), x.z.tolist(), x.t)
    tree = o.tree
    if tree is None:
        tree = spanning(model) if o.coordinates == "joint" else ()
    m = mechanics(model, tree, o.inputs, o.parameters)
    return m, drawn_or_given(m, o.at)


def drawn_or_given(m: Mechanics, at: Mapping[str, Any] | None) -> Point:
    """As drawn where loops close there, else moved."""
    if not (at is None or isinstance(at, Mapping)):
        raise ModelError(f"at={at!r}: must be a mapping of coordinates, an equilibrium, a result, or None for as drawn")
    return given(m, at or {}) if at or len(m.g) else drawn(m)
