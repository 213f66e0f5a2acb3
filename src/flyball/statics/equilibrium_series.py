"""Quasi-static series: equilibria over values of a parameter, along one branch for as long as it lasts.

Steps from value to value are taken by Newton's method where it contracts from its first iteration on (Deuflhard 2004,
"Newton Methods for Nonlinear Problems", 2.1); else the step is halved. If steps become tiny the branch has ended, for
example at a limit point, and the forces move the mechanism to another equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..analysis_options import AnalysisOptions
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import compile_mechanism
from ..errors import AnalysisError, ModelError, NotConverged
from ..model.model import Model, listing, suggest
from ..model.unsupported_elements import refuse_unsupported
from ..progress import progress_bar
from ..results.equilibrium import Equilibrium, EquilibriumSeries, Jump
from ..results.result import Result
from ..results.wording import UNSTABLE
from ..tables.element_numbers import unused_parameters
from .equilibrium import equilibrium as single
from .equilibrium import rest_options
from .equilibrium_search import (
    LONGEST_STEP,
    NEWTON_STEPS,
    equilibrium_result,
    equilibrium_there,
    newton_search,
    perturbed_along_softest,
    pseudo_transient_descent,
    search_failure,
)
from .stability import RestState, stability

MAX_HALVINGS = 16  # halvings of a step before the branch counts as ended
CONTROLLED_HALVINGS = 3  # the same with controllers, whose search is more expensive
# Largest ratio of successive Newton steps; at limit points it is 1/2.
CONTRACTION = 0.6
# Distance below which a jump counts as a steep part of the branch [rad, or relative to the mechanism's length].
JUMP_DISTANCE = 0.02
SMALLEST_STEP = 1e-7  # step size [rad, or relative to the length] at which rounding limits contraction


@dataclass(frozen=True, kw_only=True)
class EquilibriaOptions(AnalysisOptions):
    """Arguments of `Mechanism.equilibria`."""

    parameter: str
    values: Sequence[float] | np.ndarray
    t: float
    parameters: Mapping[str, float] | None
    start: Equilibrium | Result | None
    stable: bool
    progress: bool | Callable[[float], None]


def equilibria(model: Model, o: EquilibriaOptions) -> EquilibriumSeries:
    """Compute equilibria over a parameter, each from the one before: see `Mechanism.equilibria`."""
    refuse_unsupported(model, "equilibria", controlled=True)
    if model.with_states() and o.stable:
        raise ModelError("stable= is for mechanisms without controllers; leave it out")
    points = checked_values(model, o.parameter, o.values, o.t or None, o.parameters)
    way = _SeriesBranch(model, o.parameter, o.t, dict(o.parameters or {}), o.stable)
    done = EquilibriumSeries(model.name, o.parameter, points[:0], [], way.jumps)
    x: RestState | None = None
    with progress_bar(o.progress, f"equilibria over {o.parameter}") as tell:
        for k, value in enumerate(points):
            before = len(way.jumps)
            try:
                if k and model.with_states():
                    done.equilibria.append(
                        way.controlled(done.equilibria[-1], points[k - 1], value, CONTROLLED_HALVINGS)
                    )
                elif x is None:
                    first = single(model, rest_options(*way.given(value), o.start, o.stable))
                    x = None if model.with_states() else way.rest(first)
                    done.equilibria.append(first)
                else:
                    x = way.settled(way.follow(x, points[k - 1], value, MAX_HALVINGS), value)
                    how = "following" if len(way.jumps) == before else "descent"
                    done.equilibria.append(equilibrium_result(x, {}, how))
            except NotConverged as error:
                raise series_error(done, value, error) from error
            done.values = points[: k + 1]
            tell((k + 1) / len(points), f"{value:.6g}")
    return done


def checked_values(
    model: Model,
    parameter: str,
    values: Sequence[float] | np.ndarray,
    t: float | None,
    parameters: Mapping[str, float] | None,
) -> np.ndarray:
    """The values as an array; refuses unknown parameters, invalid values, and a parameter that is also fixed."""
    given = t if parameter == "t" else (parameters or {}).get(parameter)
    if given is not None:
        where = "t" if parameter == "t" else "parameters"
        raise ModelError(f"{parameter!r} takes all its values, so {where} cannot fix it at {given}; leave that out")
    known = [*model.parameters, "t"]
    if parameter not in known:
        raise ModelError(f"{model.name!r} has no parameter {parameter!r}{suggest(parameter, known)}; {listing(known)}")
    if parameter != "t" and unused_parameters(model, [parameter]):
        raise ModelError(
            f"nothing of {model.name!r} depends on {parameter!r}: all its values give the same equilibrium"
        )
    points = np.atleast_1d(np.asarray(values, float))
    if points.ndim != 1 or not len(points) or not np.isfinite(points).all():
        raise ModelError(f"values of {parameter!r} must be finite numbers in SI units, one at least, got {values!r}")
    return points


def series_error(done: Any, value: float, error: AnalysisError) -> NotConverged:
    """The error for a series that cannot continue, with the results so far."""
    n = len(done.values)
    reached = f"the last of {n} reached is {done.parameter} = {done.values[-1]:.6g}" if n else "none was reached"
    return NotConverged(
        f"the series over {done.parameter!r} stops at {done.parameter} = {value:.6g}; {reached}. {error}",
        getattr(error, "residuals", None),
        series=done,
    )


@dataclass
class _SeriesBranch:
    """Constant data of a series, and its jumps."""

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

    def rest(self, e: Equilibrium) -> RestState:
        """State at rest of an equilibrium, as the start of a step."""
        a = e.assembly
        return RestState.at(a.compiled, a.t, a.q)

    def at(self, x: RestState, value: float) -> RestState:
        """The same position with another value of the parameter."""
        t, parameters = self.given(value)
        c = compile_mechanism(self.model, parameters=parameters)
        q, _ = c.take(x.c, x.t, x.q, np.zeros(len(x.scale)))
        return RestState(c, t, q, x.lam)

    def follow(self, x: RestState, here: float, there: float, halvings: int) -> RestState:
        """Step from one value to another, along the branch or by a jump."""
        y = _contracting_newton(self.at(x, there))
        if y is not None:
            return y
        if halvings:
            middle = here + 0.5 * (there - here)
            return self.follow(self.follow(x, here, middle, halvings - 1), middle, there, halvings - 1)
        return self.jump(x, there, lambda: perturbed_along_softest(x, self.at(x, there)))

    def controlled(self, last: Equilibrium, here: float, there: float, halvings: int) -> Equilibrium:
        """Equilibrium with controllers, searched from the last one; the step is halved if the result is far away."""
        try:
            found = single(self.model, rest_options(*self.given(there), last))
        except NotConverged:
            if not halvings:
                raise
        else:
            if _assembly_distance(last.assembly, found.assembly) <= LONGEST_STEP:
                return found
            if not halvings:
                self.jumps.append(Jump(float(there), last, found))
                return found
        middle = here + 0.5 * (there - here)
        last = self.controlled(last, here, middle, halvings - 1)
        return self.controlled(last, middle, there, halvings - 1)

    def settled(self, x: RestState, value: float) -> RestState:
        """The state itself, or the stable equilibrium it moves to if stability is required and it is unstable."""
        if self.stable and stability(x).kind == UNSTABLE:
            return self.jump(x, value, lambda: perturbed_along_softest(x))
        return x

    def jump(self, x: RestState, value: float, begin: Callable[[], RestState]) -> RestState:
        """Equilibrium that the forces lead to from one that no longer exists."""
        downhill = pseudo_transient_descent(begin())
        y = None if downhill is None else newton_search(downhill)
        if y is None:
            raise search_failure(downhill or x)
        if _rest_distance(x, y) > JUMP_DISTANCE:
            self.jumps.append(
                Jump(float(value), equilibrium_result(x, {}, "following"), equilibrium_result(y, {}, "descent"))
            )
        return y


def _rest_distance(x: RestState, y: RestState) -> float:
    """Largest displacement of the bodies between two states: relative to the length, or of rotation matrix entries."""
    return _assembly_distance(*(Assembly(r.c, r.t, r.q, np.zeros(len(r.scale))) for r in (x, y)))


def _assembly_distance(x: Assembly, y: Assembly) -> float:
    """Largest displacement of the bodies between two assemblies, as in `_rest_distance`."""
    a, b = (r.compiled.moving(r.t, r.q, np.zeros_like(r.v)) for r in (x, y))
    length = x.compiled.values.length
    return max(max(np.abs(a[k].p - b[k].p).max() / length, np.abs(a[k].R - b[k].R).max()) for k in a)


def _contracting_newton(x: RestState) -> RestState | None:
    """Newton's method; None unless it contracts from its first step on, which means that the solution is near."""
    last = LONGEST_STEP
    for k in range(NEWTON_STEPS):
        step, lam = x.step()
        size = np.abs(step).max(initial=0.0)
        allowed = last if k == 0 else max(CONTRACTION * last, SMALLEST_STEP)
        if not size <= allowed:
            return None
        x, last = x.moved(step, lam), size
        if size <= SMALLEST_STEP**0.5 and (best := equilibrium_there(x)):
            return best
    return None
