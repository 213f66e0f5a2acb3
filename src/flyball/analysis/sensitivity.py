"""Sensitivities: exact derivatives of kinematics, reactions, equilibria, eigenvalues and motions by parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import ModelError, SingularityError
from ..model.expressions import number
from ..model.model import Model, listing, suggest
from ..model.quantities import one
from ..model.wiring import wired
from ..results.result import Result
from ..results.sensitivity import Sensitivity
from .assemble import assemble
from .compiled import Compiled, compiled
from .equilibrium import equilibrium, resting
from .linear.begun import held, start_changes, start_tangents
from .linear.carried import carried
from .linear.controlled import determined_copy
from .linear.curves import over_time, slopes, snapshot
from .linear.derivatives import Equations, State, stepped_values
from .linear.differences import Found, check, whole
from .linear.jumps import refuse_jumps, refuse_switching
from .linear.kinks import refuse_kinks
from .linear.moded import at_modes, of_modes
from .linear.own_words import in_own_words
from .linear.question import Question
from .linear.rest import Rest
from .linear.sliders import Scale, Slid, beginnings, refuse_sampled, slid
from .linear.tangent import Direction, Linear, Tangent, friction
from .linear.undetermined import refuse_undetermined, told_by_reactions
from .linear.variation import Variation, Varied, followed
from .motion.ahead import refuse_missing
from .motion.choice import SimulateOptions
from .motion.layer import known
from .motion.options import output_times, projected
from .motion.start import begin
from .options import Options, positive
from .simulate import clock_for, simulate
from .untouched import refuse_contact, refuse_controllers

FLAT = 1e-8  # stiffness, of what acts, below which an equilibrium's place is not determined


USUAL = {"outputs": 51, "rtol": 1e-9, "atol": 1e-11}  # of a motion, where they are not given


@dataclass(frozen=True, kw_only=True)
class DerivativeOptions(Options):
    """What derivatives are asked of: quantities, parameters, and the analysis that makes the ones of the others."""

    analysis: str
    t: float
    t_end: float | None
    outputs: int | Sequence[float] | None
    parameters: Mapping[str, float] | None
    about: str | None
    rtol: float | None
    atol: float | None
    coordinates: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.analysis not in ANALYSES:
            all_ = list(ANALYSES)
            raise ModelError(f"unknown analysis {self.analysis!r}{suggest(self.analysis, all_)}; {listing(all_)}")
        for name in ("t_end", "outputs", "rtol", "atol"):
            if getattr(self, name) is not None and self.analysis != "motion":
                raise ModelError(f"{name} is of a motion; with analysis={self.analysis!r} it does nothing")
        if self.analysis == "motion" and self.t_end is None:
            raise ModelError("sensitivity of a motion: give t_end")
        known(self.coordinates)
        if self.coordinates != "auto" and self.analysis != "motion":
            raise ModelError(f"coordinates are those of a motion; with analysis={self.analysis!r} they do nothing")
        for name in ("rtol", "atol"):
            if getattr(self, name) is not None:
                positive(getattr(self, name), name)
        if self.about is not None and self.analysis != "modes":
            raise ModelError(f"about is for modes; with analysis={self.analysis!r} it does nothing")
        if self.about not in (None, "equilibrium"):
            raise ModelError(f"about must be 'equilibrium' or nothing, got {_what(self.about)}")

    def of_motion(self, name: str) -> Any:
        """An option of a motion, or what is usual."""
        value = getattr(self, name)
        return USUAL[name] if value is None else value


@dataclass(frozen=True, kw_only=True)
class SensitivityOptions(DerivativeOptions):
    """What `Mechanism.sensitivity` is asked."""

    of: tuple[str, ...]
    to: tuple[str, ...]
    verify: bool

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.of and self.analysis != "modes":
            raise ModelError("say which quantities: of=['slider.x'], for instance")


def sensitivity(model: Model, o: SensitivityOptions) -> Sensitivity:
    """Derivatives of quantities with respect to parameters: see `Mechanism.sensitivity`."""
    if model.controllers:
        return _controlled(model, o)
    return _asked(model, o)


def _asked(model: Model, o: SensitivityOptions) -> Sensitivity:
    a = _question(model, o)
    out = ANALYSES[o.analysis][0](a)
    env = model.environment(o.parameters)
    out.parameters = {name: env[name] for name in a.to}
    return _verified(a, o.analysis, out) if o.verify else out


def _question(model: Model, o: SensitivityOptions) -> Question:
    """What is asked, looked through: names there are, of quantities and parameters."""
    refuse_contact(model, "sensitivity", controlled=True)
    env = model.environment(o.parameters)
    for name in o.to:
        if name not in env:
            raise ModelError(
                f"{model.name!r} has no parameter {name!r}{suggest(name, list(env))}; {listing(list(env))}"
            )
    for name in o.of if o.analysis != "modes" else ():
        one(model, name)
    if not env:
        raise ModelError(f"{model.name!r} has no parameters to take derivatives by; give it some: parameters={{...}}")
    return Question(
        model.snapshot(),
        o.of,
        o.to or tuple(env),
        o.t,
        dict(o.parameters or {}),
        np.zeros(0) if o.t_end is None else output_times(o.t, o.t_end, o.of_motion("outputs")),
        o.about,
        o.of_motion("rtol"),
        o.of_motion("atol"),
        o.coordinates,
    )


def _controlled(model: Model, o: SensitivityOptions) -> Sensitivity:
    """Of a mechanism with controllers: of one that has bodies in their place."""
    if o.analysis not in ("motion", "equilibrium", "modes") or model.events:
        refuse_controllers(
            model, f"sensitivity with analysis={o.analysis!r}" + (", with events," if model.events else "")
        )
    if o.analysis != "motion":
        return _asked(model, o)
    refuse_sampled(model, "sensitivity")
    a = _question(model, o)
    refuse_switching(model, a.to)
    other = moving_copy(model, o.parameters, o.of)
    named = tuple(other.outputs.get(name, name) for name in o.of)
    with in_own_words(other):
        found = _named(_asked(other.model, replace(o, of=named, verify=False)), o.of, other)
    return _verified(a, o.analysis, found) if o.verify else found


def _named(found: Sensitivity, of: tuple[str, ...], other: Slid) -> Sensitivity:
    """What was found of a copy, by the names of the model."""
    units = ("" if name in other.outputs else u for name, u in zip(of, found.units, strict=True))
    return replace(found, of=of, units=tuple(units))


def _verified(a: Question, analysis: str, out: Sensitivity) -> Sensitivity:
    """With the column of central differences."""
    again = ANALYSES[analysis][1](a)
    parts = [check(a.model, a.parameters, name, again) for name in a.to]
    out.verification = np.stack([x.reshape(out.values.shape) for x in parts], axis=-1)
    return out


def _what(value: Any) -> str:
    """A value in a message: a text as it is, else what kind of thing it is."""
    return repr(value) if isinstance(value, (str, float, int)) else f"a {type(value).__name__}"


def _row(x: State, names: Sequence[str]) -> np.ndarray:
    """Values of curves at one state."""
    shot = snapshot(x)
    return np.array([float(shot.curve(name)[1][0]) for name in names])


def _units(x: State, names: Sequence[str]) -> tuple[str, ...]:
    shot = snapshot(x)
    return tuple(shot.curve(name)[0] for name in names)


def _columns(a: Question, x: State, directions: Sequence[Direction], tangents: Sequence[Tangent]) -> np.ndarray:
    """Derivatives of the quantities at a state, (of, to)."""
    refuse_undetermined(x, a.of)
    return np.array([slopes(x, a.of, d.parts, k.values)[0] for k, d in zip(directions, tangents, strict=True)]).T


def _instant(a: Question) -> Sensitivity:
    base = assemble(a.model, t=a.t, parameters=a.parameters)
    x = State.moving(base.compiled, base.t, base.q, base.v)
    e = Equations(x)
    directions = [Direction(e, name) for name in a.to]
    tangents = start_tangents(a.model, a.parameters, base, x, directions)
    _refuse_kinks(a, e, tangents)
    found = _columns(a, x, directions, tangents)
    return Sensitivity("instant", a.of, a.to, _units(x, a.of), {}, np.array([a.t]), _row(x, a.of)[None], found[None])


def _refuse_kinks(a: Question, e: Equations, tangents: Sequence[Tangent]) -> None:
    """Refuse forces that have no slope along the changes with the parameters, or by one of these."""
    none = np.zeros((len(e.state.v), 1))
    dq, dv = (np.column_stack([none, *ways]) for ways in ([k.q for k in tangents], [k.v for k in tangents]))
    refuse_kinks(e, dq, dv, a.to)


def _at_instant(a: Question) -> Found:
    def found(parameters: Mapping[str, float]) -> np.ndarray:
        b = assemble(a.model, t=a.t, parameters=parameters)
        return _row(State.moving(b.compiled, b.t, b.q, b.v), a.of)

    return found


def _motion(a: Question) -> Sensitivity:
    begun = begin(a.model, a.t, a.parameters, None, a.coordinates)
    base, layer = begun.base, begun.assembly.compiled
    refuse_missing(base, float(a.times[-1]))
    x = State.moving(base.compiled, base.t, base.q, base.v)
    e = Equations(x)
    directions = [Direction(e, name) for name in a.to]
    values = [d.values if layer is base.compiled else stepped_values(layer, d.name) for d in directions]
    driven, lin = held(base), Linear(x)
    if layer.structure.loads:
        friction(x, lin.G)
    if not driven:
        refuse_jumps(a.model, a.to)
        _refuse_kinks(a, e, ())
    pairs = start_changes(a.model, a.parameters, base, x, directions, lin)
    start = [carried(begun, *of) for of in zip(directions, values, pairs, strict=True)]
    clock = clock_for(begun, a.t, float(a.times[-1]), a.times, projected(a.coordinates, a.rtol, a.atol))
    loop = Variation(begun, clock, values, [whole(a.model, a.parameters, name) for name in a.to])
    varied = followed(loop) if driven else loop.run(*(np.array(part) for part in zip(*start, strict=True)))
    motion = varied.result(begun)
    _refuse_undetermined(layer, varied, a.of)
    found = [motion.curve(name) for name in a.of]
    by = [over_time(motion, a.of, v, c.parts, c.z) for v, c in zip(values, varied.by, strict=True)]
    units = tuple(unit for unit, _ in found)
    return Sensitivity(
        "motion", a.of, a.to, units, {}, a.times, np.array([x for _, x in found]).T, np.stack(by, axis=-1)
    )


def _refuse_undetermined(c: Compiled, varied: Varied, of: Sequence[str]) -> None:
    """Refuse quantities that redundancy leaves open at one of the times."""
    m = varied.motion
    for k, t in enumerate(varied.t.tolist()):
        c.z[:] = m.z[k]
        state = State.moving(c, t, m.q[k], m.v[k])
        if k == 0 and not told_by_reactions(state, of):
            return
        refuse_undetermined(state, of)


def _simulated(
    a: Question, times: np.ndarray, parameters: Mapping[str, float], coordinates: str, rtol: float, atol: float
) -> Result:
    """The motion at times."""
    asked = SimulateOptions(
        t_end=float(times[-1]),
        t_start=a.t,
        outputs=times.tolist(),
        parameters=parameters,
        start=None,
        specialize=False,  # differences of motions: all by one engine
        progress=False,
        **projected(coordinates, rtol, atol).choices(),
    )
    return simulate(a.model, asked)


def _at_motion(a: Question) -> Found:
    def found(parameters: Mapping[str, float]) -> np.ndarray:
        r = _simulated(a, a.times, parameters, "auto", 1e-12, 1e-13)
        return np.stack([r.curve(name)[1] for name in a.of], axis=1)

    return found


def _equilibrium(a: Question) -> Sensitivity:
    found = equilibrium(a.model, resting(a.t, a.parameters))
    b = found.assembly
    if a.model.controllers:  # their states are unknowns, too
        other, rest = determined_copy(a.model, b, a.of)
        named = tuple(other.outputs.get(name, name) for name in a.of)
        with in_own_words(other):
            return _named(_of_rest(replace(a, model=other.model, of=named), rest), a.of, other)
    if abs(found.least) < FLAT:
        weak = ", ".join(found.weakest)
        raise SingularityError(
            f"the equilibrium of {a.model.name!r} has no stiffness along {weak}: its place is not determined, so it "
            f"has no derivatives; hold it there by a spring or a driver",
            a.t,
            tuple(found.weakest),
        )
    return _of_rest(a, Rest.at(b.compiled, b.t, b.q))


def _of_rest(a: Question, rest: Rest) -> Sensitivity:
    """By the equations at rest: changes of positions and multipliers make up for those by the parameters."""
    x = rest.equations.state
    directions, tangents = [Direction(rest.equations, name) for name in a.to], []
    still = np.zeros(len(x.v))
    for d in directions:
        left = d.along(x, still, still)
        q, lam = rest.solved(left[d.e.at["r"]], left[d.e.at["g"]])
        tangents.append(Tangent(q, still, still, lam))
    _refuse_kinks(a, rest.equations, tangents)
    column = _columns(a, x, directions, tangents)
    return Sensitivity(
        "equilibrium", a.of, a.to, _units(x, a.of), {}, np.array([a.t]), _row(x, a.of)[None], column[None]
    )


def _at_rest(a: Question) -> Found:
    begin = equilibrium(a.model, resting(a.t, a.parameters))

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        b = equilibrium(a.model, resting(a.t, parameters, begin))
        return _row(State.resting(b.assembly.compiled, a.t, b.assembly.q, b.result.multipliers[0]), a.of)

    return found


# what finds the derivatives, and what makes a function of the parameters for differences
ANALYSES: dict[str, tuple[Callable[[Question], Sensitivity], Callable[[Question], Found]]] = {
    "instant": (_instant, _at_instant),
    "motion": (_motion, _at_motion),
    "equilibrium": (_equilibrium, _at_rest),
    "modes": (of_modes, at_modes),
}


# A mechanism with controllers whose motion is asked about, as one that has bodies in their place (`sliders`).


LIGHT = 1e-3  # of the mechanism's mass, that of a body for a state: errors of works are judged by the mass of all


def moving_copy(model: Model, parameters: Mapping[str, float] | None, outputs: Sequence[str]) -> Slid:
    """The copy in which velocities stand for states, which begins as the model does.

    Parameters
    ----------
    model : Model
        With continuous controllers.
    parameters : mapping
        Values in place of the model's.
    outputs : sequence of str
        Curves that are asked for.
    """
    c = compiled(model, parameters=parameters)
    mass = LIGHT * float(c.values.system.bodies.mass.sum()) or 1.0
    scales = {x.name: Scale(push=mass, mass=mass) for x in wired(model)}
    begin, env = beginnings(model), model.environment(parameters)
    other = slid(model, begin, outputs, scales=scales, board=mass)
    now = {name: number(text, env, None, f"what {name!r} begins with") for name, text in begin.items()}
    return replace(other, at=now)
