"""Choice of the method (explicit or implicit integrator, or impulse time stepping), and the reason for it.

This module also adds contact points to a copy of the model for event-driven integration, and checks what implicit
integrators support.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, NamedTuple

from ..errors import ModelError
from ..laws.python_functions import refuse_function_laws
from ..mobility.mobility import mobility
from ..model.contact import not_for_impulse_stepping
from ..model.contact_point import Touch
from ..model.controller_signals import controller_states
from ..model.messages import suggest
from ..model.model import Model
from ..numerics.integrators.butcher_tableaux import TABLEAUX
from ..results.diagnostics import undetermined_loads
from ..results.result import Result
from ..tables.contact_places import ContactPlaces, contact_places
from ..tables.element_numbers import element_numbers
from .diagnosis import InitialOverlap, UnresolvedInstant
from .initial_state import InitialState, initial_state_at, start_of_motion
from .integration_options import MOST_STEPS, Integration, Stepping
from .jacobian_pattern import jacobian_layout
from .solver_switching import AUTO_CODE as EITHER
from .solver_switching import EXPLICIT_METHOD, check_specialize

FEW = 16  # largest number of contact points for event-driven integration; with more, impulse stepping costs far less
MOST_CORNERS = 3  # contact points of two bodies in space among which friction is still determined
MOST_COPIES = 4  # cached copies of one model at different parameter values
IMPULSE_REMEDY = "leave method out, or give method='impulse'"


def contact_points(model: Model, parameters: Mapping[str, float] | None) -> ContactPlaces:
    """Return the contact points of a model at the given parameter values."""
    given = element_numbers(model, parameters)
    return model.cache.get("places", given.key, MOST_COPIES, lambda: contact_places(model, given))


def unsupported_contacts(model: Model, parameters: Mapping[str, float] | None) -> str:
    """Describe contacts that constraint rows do not support; empty if all are supported."""
    if not (model.contacts or model.bulk):
        return ""
    p = contact_points(model, parameters)
    return f"{_first_of_several(p.why_not)}, which only impulse time stepping supports" if p.why_not else ""


def too_many_contacts(model: Model, parameters: Mapping[str, float] | None) -> str:
    """Return why impulse time stepping is preferable (too many contact points, friction undetermined); empty if it is
    not.
    """
    places = contact_points(model, parameters).touches
    if len(places) > FEW:
        return f"bodies may touch at {len(places)} points, too many for event-driven integration (at most {FEW})"
    return "" if model.planar else _indeterminate_friction(places)


def _indeterminate_friction(places: Sequence[Touch]) -> str:
    """Name two bodies in space whose friction is undetermined at many contact points; empty if there are none."""
    pairs = Counter((e.body_i, e.body_j) for e in places if e.slips)
    for (a, b), n in pairs.items():
        if n > MOST_CORNERS:
            return f"how {a!r} and {b!r} share friction among {n} corners is not determined"
    return ""


def with_contact_points(model: Model, parameters: Mapping[str, float] | None) -> Model:
    """Return a copy of the model with its contact points as elements.

    Raises
    ------
    ModelError
        If constraint rows do not support all contacts.
    """
    if not model.contacts or any(isinstance(e, Touch) for e in model.forces):
        return model
    p = contact_points(model, parameters)
    if p.why_not:
        raise ModelError(
            f"{model.contacts[0].title}: event-driven integration supports contact of balls, corners and rounded ends "
            "with planes, of balls with balls, boxes and capsules, and in the plane of rectangles and segments. Here "
            f"{_first_of_several(p.why_not)}; {IMPULSE_REMEDY}"
        )
    key = element_numbers(model, parameters).key
    return model.cache.get("with places", key, MOST_COPIES, lambda: _with_touches(model, p.touches))


def _with_touches(model: Model, touches: tuple[Touch, ...]) -> Model:
    out = model.copy()
    for e in touches:
        out.add(e)
    return out.snapshot()


def _first_of_several(texts: tuple[str, ...]) -> str:
    """Return the first text and the number of the others."""
    return texts[0] + (f" (and {len(texts) - 1} more)" if len(texts) > 1 else "")


RADAU, GENERALISED_ALPHA, VARIATIONAL = "radau", "generalised-alpha", "variational"
IMPLICIT_METHODS = (RADAU, GENERALISED_ALPHA, VARIATIONAL)
"""Implicit integrators by name; each has its own compiled loop."""
FIXED_STEP_METHODS = (GENERALISED_ALPHA, VARIATIONAL)
"""Implicit integrators with steps of fixed width, which has to be given."""
DEFAULT_RHO_INF = 0.8  # default spectral radius at infinity of generalised-alpha
MOST_JOINT_GROUPS = 40  # column groups of the Jacobian up to which joint coordinates cost less than absolute ones


def explicit_substitute(method: str) -> str:
    """Return the explicit integrator that is used where an implicit one is not applicable."""
    return EXPLICIT_METHOD if method in IMPLICIT_METHODS else method


def refuse_idle_options(o: Any) -> None:
    """Refuse options that have no effect with implicit integrators.

    Raises
    ------
    ModelError
        Naming the option.
    """
    if o.method in FIXED_STEP_METHODS and o.step is None:
        raise ModelError(f"method={o.method!r} takes steps of fixed width: give one, for instance step='1 ms'")
    alone = o.method != VARIATIONAL  # whether it can keep positions alone
    if o.stabilization not in (("projection", "none") if alone else ("projection",)):
        other = ", or give 'none', and it keeps positions alone (index 3)" if alone else ""
        raise ModelError(
            f"stabilization={o.stabilization!r} does nothing with method={o.method!r}, which keeps positions and "
            f"velocities on the constraints itself; leave it out{other}"
        )
    if o.specialize is True:
        raise ModelError(
            f"specialize=True has no effect with method={o.method!r}, which uses the general engine; leave it out"
        )


def in_suitable_coordinates(
    start: InitialState, method: str, wish: str, parameters: Mapping[str, float] | None
) -> InitialState:
    """Return the start in coordinates that suit implicit integrators.

    Joint coordinates of long chains have full matrices, and drivers prescribe some of them; such mechanisms use
    absolute coordinates.

    Raises
    ------
    ModelError
        For what implicit integrators do not support.
    """
    s = start.assembly.compiled.structure
    if method != RADAU:
        _refuse_open_loads(start, method)
    if method == VARIATIONAL and wish == "joint":
        raise ModelError(f"method={VARIATIONAL!r} takes absolute coordinates, in which masses do not change: leave "
                         f"coordinates out")  # fmt: skip
    if not s.tree or wish == "absolute":
        return start
    if method == VARIATIONAL:
        why = "masses do not change in these, as the variational method needs it"
    elif s.prescribed:
        if wish == "joint":
            raise ModelError(
                f"method={method!r} does not support coordinates that drivers prescribe ({', '.join(s.prescribed)}), "
                "as they are in joint coordinates: leave coordinates out"
            )
        why = "drivers' coordinates are rows in an implicit method"
    elif wish == "auto" and (groups := _jacobian_groups(start)) > MOST_JOINT_GROUPS:
        why = f"matrices of {groups} joint coordinates, which follow each other, are full"
    else:
        return start
    out = initial_state_at(start.base, parameters, "absolute", start.before, switches=True)
    out.since, out.part, out.coordinates = start.since, start.part, f"absolute: {why}"
    return out


def reason_against_implicit(start: InitialState) -> str:
    """Return why a motion in these coordinates cannot continue by an implicit method; empty if it can."""
    s = start.assembly.compiled.structure
    try:
        refuse_function_laws(s.functions, between_samples=True)
        _refuse_open_loads(start, RADAU)
    except ModelError as error:
        return str(error).removesuffix("; leave method out, or take the redundancy out")
    if start.assembly.compiled.values.system.scales.semidefinite > 0.0:
        return "a body has no inertia about some axis, which method='radau' does not support"
    if not s.tree:
        return ""
    if s.prescribed:
        return f"drivers prescribe coordinates ({', '.join(s.prescribed)}); method='radau' takes absolute ones"
    return (
        ""
        if _jacobian_groups(start) <= MOST_JOINT_GROUPS
        else "its chains are long; method='radau' takes absolute coordinates"
    )


def _refuse_open_loads(start: InitialState, method: str) -> None:
    """Refuse friction that depends on reactions which redundancy leaves undetermined."""
    s = start.base.compiled.structure
    found = undetermined_loads(s.loads, mobility(s.model, start.base).undetermined) if s.loads else []
    if found:
        names = ", ".join(f.title for f, _ in found)
        raise ModelError(
            f"method={method!r} cannot have {names}: it depends on reactions that redundant constraints leave "
            "undetermined (m.mobility() names them); leave method out, or remove the redundancy"
        )


def _jacobian_groups(start: InitialState) -> int:
    """Return how many evaluations a Jacobian takes in joint coordinates."""
    c = start.assembly.compiled
    return jacobian_layout(c.structure, c.system).groups


AUTO_METHOD, IMPULSE_METHOD, DEFAULT_INTEGRATOR = (
    "auto",
    "impulse",
    "dop853",
)  # method names besides the integrators; the default integrator
METHOD_SYNONYMS = {
    "impulses": IMPULSE_METHOD,
    "stepping": IMPULSE_METHOD,
    "steps": IMPULSE_METHOD,
    "adaptive": DEFAULT_INTEGRATOR,
    "rk": "rk45",
    "stiff": "radau",
    "implicit": "radau",
    "generalized-alpha": GENERALISED_ALPHA,
    "alpha": GENERALISED_ALPHA,
    "newmark": GENERALISED_ALPHA,
    "hht": GENERALISED_ALPHA,
    "symplectic": VARIATIONAL,
    "verlet": VARIATIONAL,
    "rattle": VARIATIONAL,
    "energy-momentum": VARIATIONAL,
}
"""Synonyms of method names, for hints in messages."""
INTEGRATOR_DEFAULTS = {
    "rtol": 1e-7, "atol": None, "stabilization": "projection", "alpha": None, "beta": None, "specialize": EITHER,
    "max_steps": MOST_STEPS, "step": None,
    "rho_inf": None,
}  # fmt: skip
"""Integration options without effect on impulse time stepping, with their defaults."""
IMPULSE_STEPPING = "impulse time stepping"


@dataclass(frozen=True, kw_only=True)
class SimulateOptions(Integration):
    """Arguments of `Mechanism.simulate`."""

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
        object.__setattr__(self, "start", start_of_motion(self.start))
        check_specialize(self.specialize)
        if self.method in IMPLICIT_METHODS:
            refuse_idle_options(self)
        self._check_damping()

    def _check_damping(self) -> None:
        """Check the spectral radius at infinity; only generalised-alpha takes it."""
        if self.rho_inf is None:
            return
        if self.method != GENERALISED_ALPHA:
            raise ModelError(
                f"rho_inf belongs to method={GENERALISED_ALPHA!r}; with method={self.method!r} it has no effect"
            )
        if isinstance(self.rho_inf, bool) or not isinstance(self.rho_inf, Real) or not 0.0 <= self.rho_inf <= 1.0:
            raise ModelError("rho_inf is a number from 0 (oscillations too fast for the step are removed at once) to "
                             f"1 (no oscillation is damped), got {self.rho_inf!r}")  # fmt: skip

    def check_method(self) -> None:
        """Check that the method is an integrator, impulse time stepping, or ``"auto"``."""
        if isinstance(self.method, Stepping):
            return
        if isinstance(self.method, str) and self.method in (AUTO_METHOD, IMPULSE_METHOD, *IMPLICIT_METHODS):
            return
        known = [*sorted(TABLEAUX), *IMPLICIT_METHODS, IMPULSE_METHOD, AUTO_METHOD]
        meant = METHOD_SYNONYMS.get(str(self.method).lower())
        if not isinstance(self.method, str) or self.method not in TABLEAUX:
            hint = f" (did you mean {meant!r}?)" if meant else suggest(self.method, known)
            raise ModelError(
                f"unknown method {self.method!r}{hint}; choose one of {', '.join(known)}, or a Stepping, for contact"
            )
        self.refuse_without_step()


class MethodChoice(NamedTuple):
    """The chosen method of a simulation.

    Attributes
    ----------
    options : SimulateOptions
        With an integrator by name, or a `Stepping`.
    why : str
        The reason, for the health report; empty where there was nothing to choose.
    instead : SimulateOptions, optional
        Impulse time stepping, to be used if the integration turns out not to be possible.
    """

    options: SimulateOptions
    why: str = ""
    instead: SimulateOptions | None = None


def choose_method(model: Model, o: SimulateOptions) -> MethodChoice:
    """Choose the method.

    Raises
    ------
    ModelError
        If the requested method does not support the model or one of the options. With ``"auto"``, if no method
        supports all of them.
    """
    if o.method == AUTO_METHOD:
        return _choose_automatically(model, o)
    touch = bool(model.contacts or model.bulk)
    if o.method == VARIATIONAL and model.with_states():
        raise ModelError(
            f"method={o.method!r} is for conservative motions, and computes works with an error of second order; it "
            f"does not support {model.with_states()[0].title}: leave method out, or give method='radau'"
        )
    if not isinstance(o.method, Stepping) and o.method != IMPULSE_METHOD:
        if model.bulk:
            raise ModelError(
                f"method={o.method!r} is event-driven, which does not support {model.bulk[0].title}: leave method "
                f"out, or give method={IMPULSE_METHOD!r}"
            )
        return MethodChoice(o, _remark_on_requested(o, touch))
    given = [f"{name}={getattr(o, name)!r}" for name in _given_options(o)]
    if unknown := unknown_to_impulse_stepping(model):
        raise ModelError(
            f"{IMPULSE_STEPPING} does not support {', '.join(unknown)}; the adaptive integrators do: leave method "
            f"out, or give method={DEFAULT_INTEGRATOR!r}"
        )
    if given:
        instead = "; Stepping(step=...) is theirs" if o.step is not None else ""
        raise ModelError(f"{given[0]} does nothing with {IMPULSE_STEPPING}; leave it out{instead}")
    if o.coordinates == "joint":
        raise ModelError(
            f"{IMPULSE_STEPPING} uses absolute coordinates, where joints close to rounding; leave coordinates out"
        )
    return MethodChoice(_impulse_options(o), f"{IMPULSE_STEPPING}, as requested")


def _remark_on_requested(o: SimulateOptions, touch: bool) -> str:
    """Return the health remark on an integrator that was requested; empty if there is nothing to remark."""
    parts = [f"steps of {o.step:g} s"] if o.step is not None else []
    if o.method == GENERALISED_ALPHA:
        parts.append(f"rho_inf = {DEFAULT_RHO_INF if o.rho_inf is None else o.rho_inf:g}")
    if o.method in IMPLICIT_METHODS and o.stabilization == "none":
        parts.append("index 3: velocities are not projected on the constraints")
    if not (touch or parts or o.method in IMPLICIT_METHODS):
        return ""
    return ", ".join([f"{o.method}, as requested", *parts]) + (": event-driven" if touch else "")


def _choose_automatically(model: Model, o: SimulateOptions) -> MethodChoice:
    """Choose the method where none is requested."""
    adaptive = o.known(method=DEFAULT_INTEGRATOR)
    if not (model.contacts or model.bulk):
        return MethodChoice(adaptive)
    asking = [*unknown_to_impulse_stepping(model), *(f"{name}=" for name in _given_options(o))]
    if o.coordinates == "joint":
        asking.append("coordinates='joint'")
    cannot = unsupported_contacts(model, o.parameters)
    if cannot and asking:
        raise ModelError(
            f"{model.name!r} cannot be simulated by any method with all these elements: {cannot}; and "
            f"{IMPULSE_STEPPING} does not support {asking[0]}. Leave one of the two out"
        )
    if cannot:
        return MethodChoice(_impulse_options(o), f"{IMPULSE_STEPPING}: {cannot}")
    if asking:
        return MethodChoice(
            adaptive, f"{DEFAULT_INTEGRATOR}, event-driven: {IMPULSE_STEPPING} does not support {asking[0]}"
        )
    why = too_many_contacts(model, o.parameters) or _continues_impulse_stepping(o.start)
    if why:
        return MethodChoice(_impulse_options(o), f"{IMPULSE_STEPPING}: {why}")
    return MethodChoice(adaptive, f"{DEFAULT_INTEGRATOR}, event-driven", _impulse_options(o))


def unknown_to_impulse_stepping(model: Model) -> list[str]:
    """Return what impulse time stepping does not support; controllers without states are part of the forces' laws."""
    with_states = dict.fromkeys(x.controller.title for x in controller_states(model))
    return [*(e.title for e in model.events), *with_states, *(e.title for e in not_for_impulse_stepping(model))]


def _given_options(o: SimulateOptions) -> list[str]:
    """Return the names of given options that apply to an integration only."""
    return [name for name, usual in INTEGRATOR_DEFAULTS.items() if getattr(o, name) != usual]


def _impulse_options(o: SimulateOptions) -> SimulateOptions:
    method = o.method if isinstance(o.method, Stepping) else Stepping()
    return o.known(method=method.bounded(o.max_step))


def _continues_impulse_stepping(start: Result | None) -> str:
    """Return the reason for impulse time stepping if the earlier result used it; else an empty string."""
    if start is None or not isinstance(start.health.options.get("method"), Mapping):
        return ""
    return "as in the motion that this one continues"


def is_unresolved(error: BaseException) -> bool:
    """Return whether the motion failed at an instant that rigid-body contact leaves unresolved, or by an initial
    overlap.
    """
    return isinstance(error, InitialOverlap | UnresolvedInstant) or isinstance(error.__cause__, UnresolvedInstant)


def reason_for_impulses(error: BaseException) -> str:
    """Return the health remark on why impulse time stepping replaced the integration."""
    found = error.__cause__ if isinstance(error.__cause__, UnresolvedInstant) else error
    return f"{IMPULSE_STEPPING}, since event-driven integration failed: {found}"
