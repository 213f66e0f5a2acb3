"""Linear equations of motion about an equilibrium or a steady motion, with named inputs and outputs.

Perturbed by inputs w, the reduced equations (see ``reduced``) read x' = A x + B0 w + B1 w' + B2 w''. Inputs that move
the mechanism (drivers, lengths) act through their rates too, because the constraints hold for positions, velocities and
accelerations; a change of the state, x~ = x - B2 w' - (B1 + A B2) w, takes the rates out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..errors import ModelError
from ..model.controller import Controller
from ..model.model import Model
from ..model.quantities import ENERGY, one
from ..model.sensor import Sensor
from ..model.touching import holds_at_times
from ..results.booked import ADDED
from ..results.descriptor import Descriptor
from ..results.equilibrium import Equilibrium
from ..results.linear import LinearModel, StateSpace
from ..results.result import Result
from .compiled import compiled
from .linear.curves import slopes, snapshot
from .linear.cycles import Sample, over_a_cycle, refuse_unsettled
from .linear.derivatives import Equations, State
from .linear.descriptor import descriptor, descriptor_of_large
from .linear.effects import effects, stepped
from .linear.frames import kinematic, told
from .linear.free import Free, free, refuse_singular
from .linear.in_bodies import in_bodies
from .linear.inputs import Input, with_inputs
from .linear.instant import Many, instant
from .linear.kinks import refuse_kinks
from .linear.large import FREE, Large, are_many, is_large
from .linear.reduced import Frame, Inputs, Reduced, reduced
from .linear.rounding import Doubt
from .linear.sliders import without_places
from .linear.spectrum import spectrum
from .linear.stability import by_eigenvalues
from .linear.steady import moved_on, seen_from
from .linear.undetermined import refuse_undetermined
from .options import Options
from .resting.instant import closed_instant

TURNED = 1e-5  # relative change of coefficients a moment later that is none
IMPROPER = 1e-12  # part of what makes an output follow an input at all, below which its rate's part is rounding


@dataclass(frozen=True, kw_only=True)
class InstantOptions(Options):
    """Where the mechanism is, that small motions are asked of."""

    about: Result | Equilibrium | None
    t: float | None
    parameters: Mapping[str, float] | None
    coordinates: str
    frozen: bool

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.about is not None and self.t is not None:
            raise ModelError("about has its own time: leave out t")
        if self.frozen and isinstance(self.about, Equilibrium) and not self.about.speeds:
            raise ModelError(
                "frozen is about a motion: at an equilibrium nothing moves, and it does nothing; leave it out"
            )

    def state(self, model: Model, many: Many | None = None) -> State:
        """The state there; in absolute coordinates where velocities and rows are ``many``."""
        return instant(
            model, self.about, t=self.t or 0.0, parameters=self.parameters, coordinates=self.coordinates, many=many
        )[0]


@dataclass(frozen=True, kw_only=True)
class LinearizeOptions(InstantOptions):
    """What `Mechanism.linearize` is asked."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def linearize(model: Model, o: LinearizeOptions) -> LinearModel:
    """Linear equations about an equilibrium or a steady motion: see `Mechanism.linearize`."""
    refuse_counted(model, o.outputs)
    if model.controllers:
        return small_motions(model, o)[0]
    if holds_at_times(model):
        joined, there, notes = closed_instant(model, o, "linearize")
        out = _linear(joined, there)
        out.notes = notes
        return out
    return _linear(model, o)


def _linear(model: Model, o: LinearizeOptions) -> LinearModel:
    """Of a mechanism in which nothing holds at times any more, but friction that slides."""
    for name in o.outputs:
        one(model, name)  # refuses those that do not exist; inputs are looked up where they are added
    here = model
    if o.about is None:  # the copy with inputs is assembled at once
        here, named = with_inputs(model, o.inputs)
    x = o.state(here, partial(are_many, FREE))
    large = is_large(x, FREE)
    if not large and are_many(FREE, len(x.v), len(x.c.structure.rows)):
        x = o.state(here)
    if o.about is not None:
        x, named = _with(x, o.inputs)
    if not large:
        return _small(x, o, named)[0]
    whole = Large.at(x, o.frozen, _parameters(named))
    later = partial(_state_space_of, model.snapshot(), o)
    return _told(whole.e, named, o.outputs, later, descriptor_of_large(whole, named, o.outputs), None)


def small_motions(model: Model, o: LinearizeOptions) -> tuple[LinearModel, str]:
    """Linear equations of a mechanism with controllers, and their stability.

    They are those of one that has bodies in their place; with sampled ones over a cycle.
    """
    d = in_bodies(model, o.state(model), o.coordinates, o.outputs, frozen=o.frozen)
    here, other = d.here, d.other
    asked = replace(o, outputs=(*(other.outputs.get(name, name) for name in o.outputs), *other.laws.values()))
    with d.in_own_words():
        x, named = _with(d.state, o.inputs)
        found, r = _small(x, asked, named, d.off)
        assert r.doubt is not None
        space, own = without_places(found.dense, r.doubt, other)
    cycle = None
    if other.laws:
        samples = _samples(here, list(other.laws), len(o.outputs))
        at = np.array([d.at[s.name] for s in samples])
        sizes = np.array([other.scales[s.name].size for s in samples])
        refuse_unsettled(samples, at, found.output_values[len(o.outputs) :], sizes, model.name)
        space, own, cycle = over_a_cycle(space, samples, len(o.outputs))
    units = ["" if name in other.outputs else u for name, u in zip(o.outputs, found.output_units, strict=False)]
    linear = LinearModel(
        model.name,
        list(zip(found.inputs, found.input_units, strict=True)),
        list(zip(o.outputs, units, strict=True)),
        found.output_values[: len(o.outputs)],
        snapshot(here),
        replace(space, eigenvalues=_sorted(np.asarray(space.eigenvalues))),
        lambda: found.descriptor,
        found.turning,
        found.seen_from,
        cycle,
    )
    return linear, by_eigenvalues(own, discrete=cycle is not None)


def _samples(here: State, names: Sequence[str], first: int) -> list[Sample]:
    """What is sampled, in the order in which it is; its laws are the outputs from ``first`` on."""
    numbers, known = here.c.values.numbers, {x.name: x for x in here.c.structure.controls}
    out = []
    for k, name in enumerate(names):
        n = numbers[known[name].controller.name]
        out.append(Sample(name, first + k, (float(n.period), float(n.offset)), known[name].signal))
    return out


def _small(
    x: State, o: LinearizeOptions, named: list[Input], off: np.ndarray | None = None
) -> tuple[LinearModel, Reduced]:
    """Of mechanisms with few velocities: the constraints are taken out; ``off`` is as in `steady.balanced`."""
    e, f, frame = _about(x, o.frozen, to=_parameters(named), off=off)
    r = reduced(e, f, frame, _effects(e, f, named), off)
    if frame.turning.any() and (named or o.outputs):
        _refuse_turning(e, f, r, frame, named, o.outputs)
    refuse_undetermined(x, o.outputs)
    space = _state_space(e, f, r, named, o.outputs)
    return _told(e, named, o.outputs, space, partial(descriptor, e, f, frame, named, o.outputs), frame), r


def _state_space_of(model: Model, o: LinearizeOptions) -> StateSpace:
    """What is dense of a large mechanism."""
    x, named = _with(o.state(model), o.inputs)
    return _small(x, o, named)[0].dense


def _with(x: State, inputs: Sequence[str]) -> tuple[State, list[Input]]:
    """The same state of a copy of the model, whose laws have the inputs."""
    model, named = with_inputs(x.c.structure.model, inputs)
    return _in_copy(model, x) if named else x, named


def _parameters(inputs: list[Input]) -> list[str]:
    """Those inputs that are parameters of the model."""
    return [i.name for i in inputs if i.name == i.parameter]


def _refuse_turning(
    e: Equations, f: Free, r: Reduced, frame: Frame, inputs: list[Input], outputs: Sequence[str]
) -> None:
    """Refuse inputs and outputs that do not turn with the mechanism: their coefficients would change with time."""
    then, g, own = moved_on(e.state, f, frame)
    later = reduced(then, g, own, _effects(then, g, inputs))
    n = len(r.rate)
    for what, names, now, other in (
        ("output", outputs, _outputs(e, r, inputs, outputs), _outputs(then, later, inputs, outputs)),
        ("input", [i.name for i in inputs], r.inputs(r.rate)[0].T, later.inputs(later.rate)[0].T),
    ):
        for k, name in enumerate(names):
            if np.abs(other[k, :n] - now[k, :n]).max(initial=0.0) > TURNED * (
                1e-300 + np.abs(now[k, :n]).max(initial=0.0)
            ):
                raise ModelError(
                    f"{what} {name!r} does not turn with the mechanism: seen from the frame in which the motion is "
                    f"steady it changes with time. Take one that does, such as a joint's coordinate or drive, or ask "
                    f"for this very instant with frozen=True"
                )


def without_inputs(
    x: State, frozen: bool = False, like: Free | None = None, off: np.ndarray | None = None
) -> tuple[Free, Frame, Reduced]:
    """The reduced linear equations at a state, in the coordinates of others if given; errors as `linearize`."""
    e, f, frame = _about(x, frozen, like, off=off)
    return f, frame, reduced(e, f, frame, None, off)


def _about(
    x: State, frozen: bool, like: Free | None = None, to: Sequence[str] = (), off: np.ndarray | None = None
) -> tuple[Equations, Free, Frame]:
    e = Equations(x)
    f = free(e, like)
    refuse_singular(e, f)
    both = np.hstack([f.Z, 0.0 * f.Zv]), np.hstack([0.0 * f.Z, f.Zv])
    refuse_kinks(e, *both, to)
    still = np.zeros((len(x.v),) * 2)
    frame = Frame(np.zeros(3), still, kinematic(x)) if frozen else seen_from(x, e, f, off)
    frame.told = told(x, frame, frozen)
    return e, f, frame


def _in_copy(model: Model, x: State) -> State:
    """The same state of a copy of the model, whose laws have inputs."""
    c = compiled(model, parameters=x.c.parameters, tree=x.c.structure.tree)
    c.follow(x.c.hints)
    return State.moving(c, x.t, x.q, x.v)


def _effects(e: Equations, f: Free, inputs: list[Input]) -> Inputs:
    """What the inputs do to the equations."""
    r, g, n = effects(e, inputs)
    return Inputs(r, g[f.on_positions], n)


def _outputs(e: Equations, r: Reduced, inputs: list[Input], names: Sequence[str]) -> np.ndarray:
    """Outputs by the states, the inputs and their rates, (outputs, n + 3 m)."""
    n = len(r.rate)
    parts = [part.T for part in (r.position, r.velocity, r.acceleration, r.multipliers)]
    out = slopes(e.state, names, parts)
    for k, i in enumerate(inputs):
        out[n + k] = slopes(e.state, names, [part[n + k : n + k + 1] for part in parts], stepped(e, i))[0]
    return out.T


def _matrices(r: Reduced, y: np.ndarray, inputs: list[Input], outputs: Sequence[str]) -> list[np.ndarray]:
    """A, B, C, D in the state in which rates of inputs do not appear."""
    A, n = r.A, len(r.rate)
    B, B1, B2 = r.inputs(r.rate)
    C, (D, D1, D2) = y[:, :n], r.inputs(y)
    shift = B1 + A @ B2
    known = np.abs(D) + np.abs(D1) + np.abs(D2) + np.abs(C) @ (np.abs(B) + np.abs(B1) + np.abs(B2))
    for rate, part in (("rate", D1 + C @ B2), ("second rate", D2)):
        bad = np.argwhere(np.abs(part) > IMPROPER * known)
        if len(bad):
            k, i = bad[0]
            raise ModelError(
                f"output {outputs[k]!r} follows the {rate} of input {inputs[i].name!r}, which no state-space model "
                f"can; leave out one of the two"
            )
    return [A, B + A @ shift, C, D + C @ shift]


def _sorted(w: np.ndarray) -> np.ndarray:
    """By imaginary, then real part; the upper one of a pair after the lower."""
    return w[np.lexsort((w.imag, w.real, np.abs(w.imag)))]


def _eigenvalues(A: np.ndarray, doubt: Doubt | None) -> np.ndarray:
    return _sorted(spectrum(A, doubt).values)


def _state_space(e: Equations, f: Free, r: Reduced, inputs: list[Input], outputs: Sequence[str]) -> StateSpace:
    A, B, C, D = _matrices(r, _outputs(e, r, inputs, outputs), inputs, outputs)
    named = [f.names[d] for d in f.chosen]
    rates = [f.names[d] for d in f.chosen_v]
    return StateSpace(
        A=A,
        B=B,
        C=C,
        D=D,
        states=(*(n.name for n in named), *(f"{n.name} rate" for n in rates)),
        state_units=(*(n.unit for n in named), *(f"{n.unit}/s" for n in rates)),
        mass=r.M,
        damping=r.D,
        stiffness=r.K,
        eigenvalues=partial(_eigenvalues, A, r.doubt),
        motion=r.position[:, : len(A)],
    )


def _told(
    e: Equations,
    inputs: list[Input],
    outputs: Sequence[str],
    dense: StateSpace | Callable[[], StateSpace],
    sparse: Descriptor | Callable[[], Descriptor],
    frame: Frame | None,
) -> LinearModel:
    shot = snapshot(e.state)
    curves = [shot.curve(name) for name in outputs]
    return LinearModel(
        e.state.c.structure.model.name,
        [(i.name, i.unit) for i in inputs],
        [(name, unit) for name, (unit, _) in zip(outputs, curves, strict=True)],
        np.array([float(values[0]) for _, values in curves]),
        shot,
        dense,
        sparse,
        np.zeros(3) if frame is None else frame.turning,
        "" if frame is None else frame.told,
    )


# Quantities that count from the start of a motion on: works and what is lost. A state says nothing of them.


OF_ENERGY = ("balance", *ADDED)
WORK = "work"


def refuse_counted(model: Model, names: Sequence[str]) -> None:
    """Refuse outputs of a linear model that integrals over the motion are.

    Raises
    ------
    ModelError
        Naming the first of them.
    """
    for name in names:
        of = str(name)
        while "." not in of and isinstance(e := model.find(of), Sensor):
            of = e.of
        owner, _, what = of.partition(".")
        if what in OF_ENERGY if owner == ENERGY else what == WORK and not isinstance(model.find(owner), Controller):
            instead = "energy.total" if owner == ENERGY else f"{owner}.power"
            raise ModelError(
                f"output {name!r} counts from the start of a motion on, so no state of a linear model tells it; ask "
                f"for {instead!r}"
            )
