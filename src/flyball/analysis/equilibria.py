"""Quasi-static series: equilibria over values of a parameter, along one branch for as long as it lasts.

Steps from value to value are taken by Newton's method where it contracts from its first step on (Deuflhard 2004,
"Newton Methods for Nonlinear Problems", 2.1); elsewhere the step is halved. Where steps have become tiny the branch has
ended, at a limit point say, and the forces push the mechanism to another equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import AnalysisError, ModelError, NotConverged
from ..model.model import Model, listing, suggest
from ..results.equilibria import EquilibriumSeries, Jump
from ..results.equilibrium import UNSTABLE, Equilibrium
from ..tables.numbers import unused
from .assembly.start import Assembly
from .compiled import compiled
from .equilibrium import equilibrium as single
from .equilibrium import resting
from .linear.found import finished
from .linear.rest import Rest
from .linear.search import LONGEST, NEWTON, arrived, descent, failure, newton, pushed
from .linear.stability import stability
from .options import Options
from .progress import shown
from .untouched import refuse_contact

HALVINGS = 16  # of a step between two values, before its branch is taken to have ended
FEWER = 3  # the same with controllers, whose search costs more
CONTRACTING = 0.6  # how much shorter Newton's steps have to become, each than the one before; at limit points 1/2
NEAR = 0.02  # in the same: a branch that goes on within this has not ended but is steep there
TINY = 1e-7  # steps, in radians or parts of the length, that rounding may keep from becoming shorter


@dataclass(frozen=True, kw_only=True)
class EquilibriaOptions(Options):
    """What `Mechanism.equilibria` is asked."""

    parameter: str
    values: Sequence[float] | np.ndarray
    t: float
    parameters: Mapping[str, float] | None
    start: Equilibrium | None
    stable: bool
    progress: bool | Callable[[float], None]


def equilibria(model: Model, o: EquilibriaOptions) -> EquilibriumSeries:
    """Equilibria over values of a parameter, each following from the one before: see `Mechanism.equilibria`."""
    refuse_contact(model, "equilibria", controlled=True)
    if model.controllers and o.stable:
        raise ModelError("stable= is for mechanisms without controllers; leave it out")
    points = checked(model, o.parameter, o.values, o.t or None, o.parameters)
    way = _Way(model, o.parameter, o.t, dict(o.parameters or {}), o.stable)
    done = EquilibriumSeries(model.name, o.parameter, points[:0], [], way.jumps)
    x: Rest | None = None
    with shown(o.progress, f"equilibria over {o.parameter}") as tell:
        for k, value in enumerate(points):
            before = len(way.jumps)
            try:
                if model.controllers:
                    here = value if k == 0 else points[k - 1]
                    last = done.equilibria[-1] if k else o.start
                    done.equilibria.append(way.controlled(last, here, value, FEWER if k else 0))
                elif x is None:
                    first = single(model, resting(*way.given(value), o.start, o.stable))
                    x = way.rest(first)
                    done.equilibria.append(first)
                else:
                    x = way.settled(way.follow(x, points[k - 1], value, HALVINGS), value)
                    how = "following" if len(way.jumps) == before else "descent"
                    done.equilibria.append(finished(x, {}, how))
            except NotConverged as error:
                raise stopped(done, value, error) from error
            done.values = points[: k + 1]
            tell((k + 1) / len(points), f"{value:.6g}")
    return done


def checked(
    model: Model,
    parameter: str,
    values: Sequence[float] | np.ndarray,
    t: float | None,
    parameters: Mapping[str, float] | None,
) -> np.ndarray:
    """The values as an array; refuses unknown parameters, what is no number, and one value besides."""
    given = t if parameter == "t" else (parameters or {}).get(parameter)
    if given is not None:
        where = "t" if parameter == "t" else "parameters"
        raise ModelError(f"{parameter!r} goes through its values, so {where} cannot hold it at {given}; leave that out")
    known = [*model.parameters, "t"]
    if parameter not in known:
        raise ModelError(f"{model.name!r} has no parameter {parameter!r}{suggest(parameter, known)}; {listing(known)}")
    if parameter != "t" and unused(model, [parameter]):
        raise ModelError(f"nothing of {model.name!r} depends on {parameter!r}: all its values would give the same")
    points = np.atleast_1d(np.asarray(values, float))
    if points.ndim != 1 or not len(points) or not np.isfinite(points).all():
        raise ModelError(f"values of {parameter!r} must be finite numbers in SI units, one at least, got {values!r}")
    return points


def stopped(done: Any, value: float, error: AnalysisError) -> NotConverged:
    """The error of a series that cannot go on, with what was reached."""
    n = len(done.values)
    reached = f"the last of {n} reached is {done.parameter} = {done.values[-1]:.6g}" if n else "none was reached"
    return NotConverged(
        f"the series over {done.parameter!r} stops at {done.parameter} = {value:.6g}; {reached}. {error}",
        getattr(error, "residuals", None),
        series=done,
    )


@dataclass
class _Way:
    """What stays the same along a series, and where it has jumped."""

    model: Model
    parameter: str
    t: float
    parameters: dict[str, float]
    stable: bool
    jumps: list[Jump] = field(default_factory=list)

    def given(self, value: float) -> tuple[float, dict[str, float]]:
        """Time and parameters at a value."""
        if self.parameter == "t":
            return float(value), self.parameters
        return self.t, {**self.parameters, self.parameter: float(value)}

    def rest(self, e: Equilibrium) -> Rest:
        """An equilibrium as a place to go on from."""
        a = e.assembly
        return Rest.at(a.compiled, a.t, a.q)

    def at(self, x: Rest, value: float) -> Rest:
        """The same place under another value."""
        t, parameters = self.given(value)
        c = compiled(self.model, parameters=parameters)
        q, _ = c.take(x.c, x.t, x.q, np.zeros(len(x.scale)))
        return Rest(c, t, q, x.lam)

    def follow(self, x: Rest, here: float, there: float, halvings: int) -> Rest:
        """On from one value to another, along the branch or by a jump."""
        y = _contracted(self.at(x, there))
        if y is not None:
            return y
        if halvings:
            middle = here + 0.5 * (there - here)
            return self.follow(self.follow(x, here, middle, halvings - 1), middle, there, halvings - 1)
        return self.jump(x, there, lambda: pushed(x, self.at(x, there)))

    def controlled(self, last: Equilibrium | None, here: float, there: float, halvings: int) -> Equilibrium:
        """The equilibrium with controllers, whose search begins at the last one; nearer steps where that is far."""
        try:
            found = single(self.model, resting(*self.given(there), last))
        except NotConverged:
            if not halvings:
                raise
        else:
            if here == there or last is None or _moved(last.assembly, found.assembly) <= LONGEST:
                return found
            if not halvings:
                self.jumps.append(Jump(float(there), last, found))
                return found
        middle = here + 0.5 * (there - here)
        last = self.controlled(last, here, middle, halvings - 1)
        return self.controlled(last, middle, there, halvings - 1)

    def settled(self, x: Rest, value: float) -> Rest:
        """The place itself, or where it leads where it must be stable and is not."""
        if self.stable and stability(x).kind == UNSTABLE:
            return self.jump(x, value, lambda: pushed(x))
        return x

    def jump(self, x: Rest, value: float, begin: Callable[[], Rest]) -> Rest:
        """Where the forces lead from an equilibrium that has ceased to be."""
        downhill = descent(begin())
        y = None if downhill is None else newton(downhill)
        if y is None:
            raise failure(downhill or x)
        if _apart(x, y) > NEAR:
            self.jumps.append(Jump(float(value), finished(x, {}, "following"), finished(y, {}, "descent")))
        return y


def _apart(x: Rest, y: Rest) -> float:
    """How far the bodies are from one place to another, in parts of the length or by the entries of their rotations."""
    return _moved(*(Assembly(r.c, r.t, r.q, np.zeros(len(r.scale))) for r in (x, y)))


def _moved(x: Assembly, y: Assembly) -> float:
    """The same from one assembly to another."""
    a, b = (r.compiled.moving(r.t, r.q, np.zeros_like(r.v)) for r in (x, y))
    length = x.compiled.values.length
    return max(max(np.abs(a[k].p - b[k].p).max() / length, np.abs(a[k].R - b[k].R).max()) for k in a)


def _contracted(x: Rest) -> Rest | None:
    """Newton's method where it contracts from its first step on: what it finds is near; else None."""
    last = LONGEST
    for k in range(NEWTON):
        step, lam = x.step()
        size = np.abs(step).max(initial=0.0)
        allowed = last if k == 0 else max(CONTRACTING * last, TINY)
        if not size <= allowed:
            return None
        x, last = x.moved(step, lam), size
        if size <= TINY**0.5 and (best := arrived(x)):
            return best
    return None
