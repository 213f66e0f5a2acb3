"""By what a motion is computed: an integrator, which goes from touch to touch, or steps by impulses; and why."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import NamedTuple

from ...errors import ModelError
from ...model.model import Model
from ...model.touching import smooth_only
from ...model.words import suggest
from ...numerics.integrators.tableaux import TABLEAUX
from ...results.result import Result
from .engines import AUTO as EITHER
from .engines import check_specialize
from .implicit.suited import ALPHA, IMPLICIT, RHO, VARIATIONAL, refuse_idle
from .impulse.settings import Stepping
from .jams import Overlap, Unresolved
from .options import MOST, Integration
from .touches import impossible, many

AUTO, IMPULSE, USUAL = "auto", "impulse", "dop853"  # methods beside the integrators by name; what auto is
CALLED = {
    "impulses": IMPULSE,
    "stepping": IMPULSE,
    "steps": IMPULSE,
    "adaptive": USUAL,
    "rk": "rk45",
    "stiff": "radau",
    "implicit": "radau",
    "generalized-alpha": ALPHA,
    "alpha": ALPHA,
    "newmark": ALPHA,
    "hht": ALPHA,
    "symplectic": VARIATIONAL,
    "verlet": VARIATIONAL,
    "rattle": VARIATIONAL,
    "energy-momentum": VARIATIONAL,
}
"""What methods are called in words."""
IDLE = {
    "rtol": 1e-7, "atol": None, "stabilization": "projection", "alpha": None, "beta": None, "specialize": EITHER,
    "max_steps": MOST, "step": None,
    "rho_inf": None,
}  # fmt: skip
"""Options of an integration that mean nothing to steps by impulses, and what they are when they are not given."""
STEPS = "steps by impulses"


@dataclass(frozen=True, kw_only=True)
class SimulateOptions(Integration):
    """What `Mechanism.simulate` is asked."""

    method: str | Stepping  # type: ignore[assignment]
    t_end: float
    t_start: float | None
    outputs: int | Sequence[float]
    parameters: Mapping[str, float] | None
    start: Result | None
    specialize: bool | str
    progress: bool | Callable[[float], None]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_specialize(self.specialize)
        if self.method in IMPLICIT:
            refuse_idle(self)
        self._check_damping()

    def _check_damping(self) -> None:
        """The spectral radius at infinity is one, and has something to do."""
        if self.rho_inf is None:
            return
        if self.method != ALPHA:
            raise ModelError(f"rho_inf is a number of method={ALPHA!r}; with method={self.method!r} it does nothing")
        if isinstance(self.rho_inf, bool) or not isinstance(self.rho_inf, Real) or not 0.0 <= self.rho_inf <= 1.0:
            raise ModelError(f"rho_inf is a number from 0 (swings too fast for a step go at once) to 1 (no swing is "
                             f"damped), got {self.rho_inf!r}")  # fmt: skip

    def check_method(self) -> None:
        """An integrator, steps by impulses, or what suits the model."""
        if isinstance(self.method, Stepping):
            return
        if isinstance(self.method, str) and self.method in (AUTO, IMPULSE, *IMPLICIT):
            return
        known = [*sorted(TABLEAUX), *IMPLICIT, IMPULSE, AUTO]
        meant = CALLED.get(str(self.method).lower())
        if not isinstance(self.method, str) or self.method not in TABLEAUX:
            hint = f" (did you mean {meant!r}?)" if meant else suggest(self.method, known)
            raise ModelError(
                f"unknown method {self.method!r}{hint}; choose one of {', '.join(known)}, or a Stepping, for contact"
            )
        self.refuse_without_step()


class Way(NamedTuple):
    """By what a motion is computed.

    Attributes
    ----------
    options : SimulateOptions
        With an integrator by name, or a `Stepping`.
    why : str
        For the health, where there was something to choose.
    instead : SimulateOptions, optional
        Steps by impulses, where the integration turns out not to be possible.
    """

    options: SimulateOptions
    why: str = ""
    instead: SimulateOptions | None = None


def chosen(model: Model, o: SimulateOptions) -> Way:
    """The method that is meant.

    Raises
    ------
    ModelError
        If the method does not know what the model has, or options have no effect on it; where none is asked for, if
        there is none for all that is there.
    """
    if o.method == AUTO:
        return _suitable(model, o)
    touch = bool(model.contacts or model.bulk)
    if o.method == VARIATIONAL and model.controllers:
        raise ModelError(
            f"method={o.method!r} is for motions that keep their energy, with works of second order at most, and does "
            f"not know {model.controllers[0].title}: leave method out, or give method='radau'"
        )
    if not isinstance(o.method, Stepping) and o.method != IMPULSE:
        if model.bulk:
            raise ModelError(
                f"method={o.method!r} integrates from event to event, which does not know {model.bulk[0].title}: leave "
                f"method out, or give method={IMPULSE!r}"
            )
        return Way(o, _asked(o, touch))
    given = [f"{name}={getattr(o, name)!r}" for name in _given(o)]
    if unknown := _smooth(model):
        raise ModelError(
            f"{STEPS} do not know {', '.join(unknown)}; the adaptive integrators do: leave method out, or give "
            f"method={USUAL!r}"
        )
    if given:
        instead = "; Stepping(step=...) is theirs" if o.step is not None else ""
        raise ModelError(f"{given[0]} does nothing with {STEPS}; leave it out{instead}")
    if o.coordinates == "joint":
        raise ModelError(
            f"{STEPS} are taken in absolute coordinates, where joints close to rounding; leave coordinates out"
        )
    return Way(_by_steps(o), f"{STEPS}, as asked")


def _asked(o: SimulateOptions, touch: bool) -> str:
    """What is said of an integrator that was asked for, where there is something to say."""
    parts = [f"steps of {o.step:g} s"] if o.step is not None else []
    if o.method == ALPHA:
        parts.append(f"rho_inf = {RHO if o.rho_inf is None else o.rho_inf:g}")
    if o.method in IMPLICIT and o.stabilization == "none":
        parts.append("index 3: velocities are not held to the constraints")
    if not (touch or parts or o.method in IMPLICIT):
        return ""
    return ", ".join([f"{o.method}, as asked", *parts]) + (": from touch to touch" if touch else "")


def _suitable(model: Model, o: SimulateOptions) -> Way:
    """The method where none is asked for."""
    adaptive = o.known(method=USUAL)
    if not (model.contacts or model.bulk):
        return Way(adaptive)
    asking = [*_smooth(model), *(f"{name}=" for name in _given(o))]
    if o.coordinates == "joint":
        asking.append("coordinates='joint'")
    cannot = impossible(model, o.parameters)
    if cannot and asking:
        raise ModelError(
            f"{model.name!r} can be moved by no method with all that is asked: {cannot}; and {asking[0]} is not known "
            f"to {STEPS}. Leave one of the two out"
        )
    if cannot:
        return Way(_by_steps(o), f"{STEPS}: {cannot}")
    if asking:
        return Way(adaptive, f"{USUAL}, from touch to touch: {asking[0]} is not known to {STEPS}")
    why = many(model, o.parameters) or _went_by_steps(o.start)
    if why:
        return Way(_by_steps(o), f"{STEPS}: {why}")
    return Way(adaptive, f"{USUAL}, from touch to touch", _by_steps(o))


def _smooth(model: Model) -> list[str]:
    """What steps by impulses do not know."""
    return [e.title for e in (*model.events, *model.controllers, *smooth_only(model))]


def _given(o: SimulateOptions) -> list[str]:
    """Options that are given and that only an integration takes."""
    return [name for name, usual in IDLE.items() if getattr(o, name) != usual]


def _by_steps(o: SimulateOptions) -> SimulateOptions:
    method = o.method if isinstance(o.method, Stepping) else Stepping()
    return o.known(method=method.bounded(o.max_step))


def _went_by_steps(start: Result | None) -> str:
    """A motion goes on as it came."""
    if start is None or not isinstance(start.health.options.get("method"), Mapping):
        return ""
    return "so went the motion that this one goes on from"


def unresolved(error: BaseException) -> bool:
    """Whether a motion failed by what rigid bodies that touch leave without an answer, or an end; or by an overlap."""
    return isinstance(error, Overlap | Unresolved) or isinstance(error.__cause__, Unresolved)


def instead_of(error: BaseException) -> str:
    """Why steps by impulses were taken after all, for the health."""
    found = error.__cause__ if isinstance(error.__cause__, Unresolved) else error
    return f"{STEPS}, since from touch to touch it does not go: {found}"
