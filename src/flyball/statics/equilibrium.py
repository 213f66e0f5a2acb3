"""Static equilibrium from a guess, with controllers, preloads or steady rotation, and its stability.

With controllers, their states are further unknowns, and their rates must be zero, too. A
preload is the force offset that makes the reference configuration an equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..analysis_options import AnalysisOptions
from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism, tangent_step
from ..constraints.switches.switch_kind import OFF
from ..derivatives.eigenvalues import spectrum
from ..derivatives.equation_derivatives import EquationDerivatives, MechanismState, StateSizes, state_sizes
from ..derivatives.linearized_equations import free_coordinates
from ..derivatives.output_derivatives import snapshot
from ..errors import AnalysisError, ModelError, NotConverged, SingularityError
from ..model.contact import has_switching_elements
from ..model.element_laws import with_inputs
from ..model.model import Model
from ..results.equilibrium import BY_EIGENVALUES, BY_MULTIPLIERS, Equilibrium, FreeStiffness
from ..results.result import Result
from ..results.wording import STABLE, UNSTABLE
from ..simulation.diagnosis import refuse_contradicting_limits
from ..tables.structure_definition import velocity_names
from .contact_equilibrium import closed_contact_equilibrium, contact_equilibrium
from .equilibrium_search import (
    LONGEST_STEP,
    equilibrium_result,
    newton_search,
    newton_search_to,
    perturbed_along_softest,
    pseudo_transient_descent,
    pseudo_transient_search,
    search_failure,
)
from .equilibrium_search import find_steady_motion as turn
from .stability import RestState, is_unstable, stability_by_eigenvalues

SCALING_PASSES = 4  # searches, each with scales taken at the end of the previous one
SINGULAR_STIFFNESS = 1e-8  # singular values below this part of the largest count as zero
NEWTON_METHOD, FOLLOWING_METHOD = "Newton's method", "following the forces and the controllers"
SIMILAR_SCALES = 30.0  # largest factor between the scales of two searches that counts as similar


def controlled_rest(
    model: Model, c: CompiledMechanism, t: float, q: np.ndarray, z: np.ndarray
) -> tuple[np.ndarray, str]:
    """Positions at rest near given ones, and the method that found them; the controller states are stored in ``c``.

    A controller whose output is at a limit has no gradient for Newton's method. The search is then first made without
    limits. If that fails, a pseudo-transient search follows the forces and the controllers.

    Parameters
    ----------
    model : Model
    c : CompiledMechanism
        The compiled model, in absolute coordinates.
    t, q : float, ndarray
    z : ndarray (nz,)
        Initial controller states.

    Raises
    ------
    NotConverged
        With the residuals.
    """
    begin = RestState(c, t, q, np.zeros(len(c.structure.rows)), z)
    try:
        return _searched_rest(begin, newton_search_to).q, NEWTON_METHOD
    except AnalysisError as error:
        why = error
    wide = without_limits(model)
    if wide is not None:
        try:
            free = compile_mechanism(wide.snapshot(), parameters=c.parameters)
            start = replace(begin, c=free, q=free.take(c, t, q, np.zeros(c.structure.nv))[0])
            found = _searched_rest(start, newton_search_to)
            return _searched_rest(replace(found, c=c), newton_search_to).q, f"{NEWTON_METHOD}, at first without limits"
        except AnalysisError:
            pass
    try:
        return _searched_rest(_searched_rest(begin, pseudo_transient_search), newton_search_to).q, FOLLOWING_METHOD
    except AnalysisError:
        raise why from None


def without_limits(model: Model) -> Model | None:
    """Copy whose controllers have no limits; None if they have none anyway."""
    freed = [(e, e.unlimited()) for e in model.controllers]
    if all(a is b for a, b in freed):
        return None
    other = model.copy()
    for a, b in freed:
        if a is not b:
            other.replace(b)
    return other


def _with_sizes(x: RestState) -> RestState:
    """The same state with the sizes of its controller states there.

    Raises
    ------
    AnalysisError
        If the lower limit of a controller exceeds the upper one.
    """
    e = replace(x, lam=0.0 * x.lam).equations
    refuse_contradicting_limits(x.c, x.t)
    moving = EquationDerivatives(MechanismState.moving(x.c, x.t, x.q, e.state.v, rotors=False))
    return replace(x, sizes=state_sizes(moving)).balanced()


def _searched_rest(x: RestState, search: Callable[[RestState], tuple[RestState | None, RestState]]) -> RestState:
    """End of a search, repeated until the sizes of the controller states are those of the end point."""
    for k in range(SCALING_PASSES):
        sized = _with_sizes(x)
        if k and _are_similar(x.sizes, sized.sizes):
            break
        found, last = search(sized)
        if found is None:
            raise _with_saturation_note(search_failure(last), last)
        x = found
    x.c.z[: len(x.z)] = x.z
    return x


def _with_saturation_note(error: NotConverged, x: RestState) -> NotConverged:
    """Add the names of controllers with an output at its limit to the error."""
    shot = snapshot(x.equations.state)
    held = [
        e.title
        for e in x.c.structure.model.controllers
        if e.unlimited() is not e and shot.curve(f"{e.name}.output")[1][0] != shot.curve(f"{e.name}.unlimited")[1][0]
    ]
    if held:
        error.args = (f"{error.args[0]}. There the output of {' and of '.join(held)} is at a limit", *error.args[1:])
    return error


def determined_rest(at_rest: Assembly) -> RestState:
    """Equilibrium with the controller states as unknowns beside the positions.

    Raises
    ------
    SingularityError
        If the equilibrium is not isolated.
    """
    from scipy.linalg import block_diag

    c, s = at_rest.compiled, at_rest.compiled.structure
    z = c.z[: len(s.controls)].copy()
    rest = _with_sizes(RestState(c, at_rest.t, at_rest.q, np.zeros(len(s.rows)), z))
    f = free_coordinates(rest.equations)
    V = block_diag(f.Zv / rest.c.sizes[:, None] * rest.c.sizes[f.chosen_v], np.eye(len(z)))
    S = V.T @ (rest.K @ V)
    for axis in (1, 0):
        size = np.abs(S).max(axis=axis, keepdims=True, initial=0.0)
        S = S / np.where(size > 0.0, size, 1.0)
    _, d, Vt = np.linalg.svd(S)
    states = [x.name for x in s.controls]
    kept = [name for name, is_kept in zip(states, rest.undetermined_states, strict=True) if is_kept]
    if kept or (len(d) and not d[-1] > SINGULAR_STIFFNESS * d[0]):
        names = [*(f.names[k].name for k in f.chosen_v), *states]
        weak = kept[0] if kept else names[int(np.argmax(np.abs(Vt[-1])))]
        raise SingularityError(
            f"the equilibrium of {s.model.name!r} is not determined along {weak!r}: other positions are equilibria "
            "too, so it has no derivatives; add a spring, a driver or a controller",
            at_rest.t,
            (weak,),
        )
    return rest


def _are_similar(a: StateSizes, b: StateSizes) -> bool:
    """Whether two sets of sizes are similar."""
    rates = [x.energy / np.where(x.rate > 0.0, x.rate, 1.0) for x in (a, b)]
    ratios = np.r_[a.change / b.change, rates[0] / rates[1]]
    return bool((np.abs(np.log(ratios)) <= np.log(SIMILAR_SCALES)).all())


LINEARIZE_DEFAULTS: dict[str, Any] = {
    "t": None, "parameters": None, "coordinates": "auto", "frozen": False, "inputs": (), "outputs": (),
    "independent": (),
}  # fmt: skip
"""Arguments of `linearize` for the stability of an equilibrium."""


@dataclass(frozen=True, kw_only=True)
class EquilibriumOptions(AnalysisOptions):
    """Arguments of `Mechanism.equilibrium`."""

    t: float
    parameters: Mapping[str, float] | None
    start: Equilibrium | Result | None
    stable: bool
    preload: tuple[str, ...]
    turning: tuple[str, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.stable and self.turning:
            raise ModelError(
                "stable=True follows decreasing potential energy from an unstable equilibrium, which a steady motion "
                "does not have. Leave stable= out and start nearer to the wanted motion: by described positions, or "
                "start="
            )
        if self.stable and self.preload:
            raise ModelError(
                "preload= keeps the reference configuration, stable=True may leave it; give one of the two"
            )
        if self.preload and self.turning:
            raise ModelError(
                "preload= is for a mechanism at rest, turning= for a steady motion; give one of the two. The effort "
                "of a driver is the force that a steady motion needs along its coordinate"
            )


def rest_options(
    t: float, parameters: Mapping[str, float] | None, start: Equilibrium | Result | None = None, stable: bool = False
) -> EquilibriumOptions:
    """Options with which other analyses compute an equilibrium."""
    return EquilibriumOptions(t=t, parameters=parameters, start=start, stable=stable, preload=(), turning=())


def equilibrium(model: Model, o: EquilibriumOptions) -> Equilibrium:
    """Find a static equilibrium near the described position, or a steady motion: see `Mechanism.equilibrium`."""
    broken = _broken_parts(model, o.start) if isinstance(o.start, Result) else ()
    if broken:
        return replace(equilibrium(model.changed(dict.fromkeys(broken)), o), broken=broken)
    if model.with_states():
        return _controlled_equilibrium(model, o)
    a = assemble(model, t=o.t, parameters=o.parameters)
    _refuse_speeds(a)
    begin = _search_start(a, _initial_guess(model, o))
    if has_switching_elements(model):
        _refuse_with_contact(o)
        return contact_equilibrium(model, begin, o.parameters, _rest_of_smooth_model)
    if o.turning:
        return _steady_motion(begin, a, o.turning)
    if o.preload:
        return equilibrium_result(*preloaded_rest(begin, o.preload), "preload")
    return _searched_equilibrium(RestState.at(a.compiled, a.t, begin.q), o.stable)


def _broken_parts(model: Model, run: Result) -> tuple[str, ...]:
    """Names of the parts of a model that broke in a motion: shear pins."""
    if run.phases is None:
        return ()
    last = zip(run.values.structure.switches, run.phases.all[-1].modes.mode, strict=True)
    broken = (x.element.name for x, mode in last if x.switch.kind.permanent and mode == OFF)
    return tuple(name for name in broken if name in model)


def _refuse_speeds(a: Assembly) -> None:
    """Refuse drivers that prescribe a rate other than zero at the instant."""
    a.compiled.at(a.t, a.q, a.v)
    for row, nu in zip(a.compiled.structure.rows, a.compiled.work.rows.nu.tolist(), strict=True):
        if row.law >= 0 and not row.holonomic and nu != 0.0:
            raise ModelError(
                f"{row.element.title} prescribes a rate of {nu:.6g} at t = {a.t:g} s, and an equilibrium is at rest; "
                "give a time at which its law is 0, or simulate until the motion is steady"
            )


def _controlled_equilibrium(model: Model, o: EquilibriumOptions) -> Equilibrium:
    """Equilibrium with controllers: their states are constant. Its stability follows from the eigenvalues."""
    for name in ("stable", "preload", "turning"):
        if getattr(o, name):
            raise ModelError(f"{name}= is for mechanisms without controllers; leave it out")
    a = assemble(model, t=o.t, parameters=o.parameters)
    _refuse_speeds(a)
    guess = _initial_guess(model, o)
    begin = _search_start(a, guess)
    begin.compiled.follow((guess or begin).compiled.hints)
    if has_switching_elements(model):
        return closed_contact_equilibrium(model, begin, o.parameters, _rest_of_closed_loop)
    return _rest_of_closed_loop(model.snapshot(), begin)


def _rest_of_closed_loop(model: Model, begin: Assembly) -> Equilibrium:
    """Positions and controller states at rest, with the stability by the eigenvalues of the closed loop."""
    from ..linear.linearize import LinearizeOptions, controlled_linear_model  # linear imports statics

    c = begin.compiled
    z = c.z[: len(c.structure.controls)].copy()
    q, way = controlled_rest(model, c, begin.t, begin.q, z)
    out = equilibrium_result(RestState.at(c, begin.t, q), {}, way)
    linear, out.stability = controlled_linear_model(model, LinearizeOptions(about=out, **LINEARIZE_DEFAULTS))
    out.judged_by = BY_MULTIPLIERS if linear.period else BY_EIGENVALUES
    return out


def _rest_of_smooth_model(model: Model, begin: Assembly) -> Equilibrium:
    """Equilibrium of a model without controllers and switching elements."""
    return _searched_equilibrium(RestState.at(begin.compiled, begin.t, begin.q), stable=False)


def _refuse_with_contact(o: EquilibriumOptions) -> None:
    """Refuse options that have no meaning when a mechanism settles onto contacts."""
    for name in ("preload", "turning", "stable"):
        if getattr(o, name):
            raise ModelError(
                f"{name}= is for mechanisms without contact; with contact the position of rest is found by a "
                "motion. Leave it out"
            )


def _initial_guess(model: Model, o: EquilibriumOptions) -> Assembly | None:
    """The equilibrium or end of a motion to start from, with its controller states; None if not given."""
    if isinstance(o.start, Result):
        _refuse_other_mechanism(model, o.start)
        s = o.start.values.structure
        q, v, z = np.split(o.start.final[1], [s.nq, s.nq + s.nv])
        return Assembly(CompiledMechanism(o.start.values, z.copy()), o.start.final[0], q, v)
    if o.start is None:
        return None
    if isinstance(o.start, Equilibrium):
        at: Assembly = o.start.assembly
        return at
    raise ModelError(
        f"start must be an equilibrium of {model.name!r}, or a result of simulate, not {type(o.start).__name__}"
    )


def _refuse_other_mechanism(model: Model, run: Result) -> None:
    """Refuse a motion of a mechanism with other bodies, joints or controllers."""
    own, other = ([[e.name for e in x] for x in (m.bodies, m.joints, m.controllers)] for m in (model, run.model))
    if own != other:
        raise ModelError(f"the result of {run.model.name!r} cannot be continued: the mechanism is a different one")


def _search_start(a: Assembly, guess: Assembly | None) -> Assembly:
    """Start of the search: as assembled, or at the guess."""
    if guess is None:
        return a
    s = a.compiled.structure
    if list(guess.compiled.structure.place) != list(s.place):
        raise ModelError(f"start must be an equilibrium of {s.model.name!r}, or of one with the same bodies")
    q, _ = a.compiled.take(guess.compiled, guess.t, guess.q, guess.v)
    return Assembly(a.compiled, a.t, q, np.zeros(s.nv))


def _searched_equilibrium(x: RestState, stable: bool) -> Equilibrium:
    """Search by Newton's method, and by descent if that fails or a stable equilibrium is wanted."""
    way, arrived, shaky = "Newton's method", None, None
    try:
        arrived = newton_search(x)
    except SingularityError as error:  # descent may lead elsewhere
        shaky = error
    unstable = arrived is not None and is_unstable(arrived)
    if arrived is not None and unstable and not stable and _differ_by_long_step(x, arrived):
        downhill = pseudo_transient_descent(x)  # Newton's method has moved away from the guess, against the forces
        below = None if downhill is None else newton_search(downhill)
        if below is not None and not is_unstable(below):
            return equilibrium_result(below, {}, "descent")
    if arrived is None or (stable and unstable):
        way = "descent"
        downhill = pseudo_transient_descent(x if arrived is None else perturbed_along_softest(arrived))
        arrived = None if downhill is None else newton_search(downhill)
        if arrived is None:
            raise shaky or search_failure(downhill or x)
    return equilibrium_result(arrived, {}, way)


def _differ_by_long_step(x: RestState, y: RestState) -> bool:
    """Whether two positions differ by more than one longest step."""
    return bool(np.abs(tangent_step(x.c, x.q, y.q) / x.scale).max(initial=0.0) > LONGEST_STEP)


def _steady_motion(a: Assembly, described: Assembly, names: Sequence[str]) -> Equilibrium:
    """Steady motion, with stability by eigenvalues; those of the rotation itself are zero."""
    from ..linear.linearize import equations_without_inputs

    c = a.compiled
    found = turn(a, described, names, c.parameters)
    x = found.state
    f, _, r = equations_without_inputs(x)
    grows = stability_by_eigenvalues(spectrum(r.A, r.uncertainty)) == UNSTABLE
    q, v = c.take(x.c, x.t, x.q, x.v)
    return Equilibrium(
        t=x.t,
        stability=UNSTABLE if grows else STABLE,
        unbalanced=found.unbalanced,
        method="Newton's method",
        parameters=dict(c.parameters),
        result=snapshot(x),
        assembly=Assembly(c, x.t, q, v),
        speeds=found.speeds,
        free_stiffness=partial(FreeStiffness, tuple(f.labels), r.K if r.K is not None else np.zeros((0, 0))),
    )


# Preload: the force offsets that make the reference configuration an equilibrium.


PRELOAD_TOLERANCE = 1e-9  # residual force relative to the applied forces
PRELOAD_ROUNDING = 1e-13  # part of a force along the free motions that counts as zero


def preloaded_rest(a: Assembly, names: Sequence[str]) -> tuple[RestState, dict[str, float]]:
    """State at rest with the smallest preloads that balance the mechanism, and these preloads.

    The forces along the free motions Z must vanish: Z^T (f + sum b_k w_k) = 0.

    Raises
    ------
    ModelError
        If a named force does not exist or has no law.
    NotConverged
        If these forces cannot balance it.
    """
    names = [names] if isinstance(names, str) else list(dict.fromkeys(names))
    model, inputs = with_inputs(a.compiled.structure.model, names)
    for i in inputs:
        if i.driver or i.name == i.parameter:
            what = "driver" if i.driver else "parameter"
            raise ModelError(f"{i.name!r} is a {what}; only forces and torques can be preloaded")
    c = compile_mechanism(model, parameters=a.compiled.parameters)
    c.follow(a.compiled.hints)
    x = RestState.at(c, a.t, a.q)
    e = x.equations
    own = free_coordinates(e)
    Z = own.Z
    by = np.array([e.by_law(i.parameter)[e.at["r"]] for i in inputs]).T
    along = Z.T @ by
    most = (np.abs(by) * own.scale[:, None]).sum(axis=0) / own.scale[own.chosen, None]
    along[np.abs(along) <= PRELOAD_ROUNDING * most] = 0.0  # a force carried by constraints balances nothing
    w = np.linalg.lstsq(along, -Z.T @ e.block("r"), rcond=1e-10)[0]
    changed = c.parameters | {i.parameter: float(value) for i, value in zip(inputs, w, strict=True)}
    loaded = compile_mechanism(model, parameters=changed)
    loaded.follow(c.hints)
    y = RestState.at(loaded, a.t, a.q)
    if not y.settled(PRELOAD_TOLERANCE):
        raise NotConverged(
            f"{', '.join(names)} cannot balance {model.name!r} in the reference configuration: {y.pushed()} "
            "nevertheless; preload other forces too",
            {n.name: float(-v) for n, v in zip(velocity_names(c.structure), y.equations.block("r"), strict=True)},
        )
    return y, dict(zip(names, w.tolist(), strict=True))
