"""Linear equations of motion about an equilibrium or a steady motion, with named inputs and outputs.

With inputs that move the mechanism (drivers, lengths) the reduced equations (see `linearized_equations`) contain rates
of inputs, which a change of state eliminates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..analysis_options import AnalysisOptions
from ..assembly.compiled_mechanism import compile_mechanism
from ..derivatives.eigenvalues import spectrum
from ..derivatives.equation_derivatives import EquationDerivatives, MechanismState, state_sizes
from ..derivatives.linearized_equations import (
    FreeCoordinates,
    InputTerms,
    MatrixUncertainty,
    ReducedEquations,
    TurningFrame,
    coordinates_named,
    free_coordinates,
    reduced_equations,
    refuse_singular_position,
    state_names,
)
from ..derivatives.nonsmooth_points import refuse_nonsmooth
from ..derivatives.output_derivatives import curve_derivatives, refuse_undetermined_outputs, snapshot
from ..derivatives.steady_motion import advanced_equations, frame_description, kinematic_matrix, steady_frame
from ..errors import ModelError
from ..model.contact import has_switching_elements
from ..model.controller import Controller, Sensor
from ..model.element_laws import Input, with_inputs
from ..model.model import Model
from ..model.names import curve_parts
from ..model.quantities import ENERGY, single_quantity
from ..results.equilibrium import Equilibrium
from ..results.events import CUMULATIVE_ENERGIES
from ..results.linear_model import Descriptor, LinearModel, StateSpaceForm
from ..results.result import Result, motion_until
from ..simulation.diagnosis import refuse_contradicting_limits
from ..statics.stability import stability_by_eigenvalues
from .descriptor import (
    DENSE_FREEDOMS,
    SparseEquations,
    dense_descriptor,
    exceeds_dense_size,
    input_effects,
    sparse_descriptor,
    uses_sparse_equations,
    values_with_input_step,
)
from .operating_point import SizeTest, contact_operating_point, operating_state
from .sampling_cycle import SampledSignal, cycle_equations, refuse_unsettled

FRAME_TOLERANCE = 1e-5  # relative change of coefficients with time that counts as none


@dataclass(frozen=True, kw_only=True)
class OperatingPointOptions(AnalysisOptions):
    """Options for the operating point of an analysis of small motions."""

    about: Result | Equilibrium | None
    t: float | None
    parameters: Mapping[str, float] | None
    coordinates: str
    frozen: bool

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.about, Equilibrium) and self.t is not None:
            raise ModelError("an equilibrium has its own time: leave out t")
        if isinstance(self.about, Result) and self.t is not None:
            object.__setattr__(self, "about", motion_until(self.about, self.t))
            object.__setattr__(self, "t", None)
        if self.frozen and isinstance(self.about, Equilibrium) and not self.about.speeds:
            raise ModelError("frozen applies to a motion; it has no effect at an equilibrium, so leave it out")

    def state(self, model: Model, many: SizeTest | None = None) -> MechanismState:
        """State at the operating point; in absolute coordinates if ``many`` holds for its velocities and rows."""
        return operating_state(
            model, self.about, t=self.t or 0.0, parameters=self.parameters, coordinates=self.coordinates, many=many
        )[0]


@dataclass(frozen=True, kw_only=True)
class LinearizeOptions(OperatingPointOptions):
    """Arguments of `Mechanism.linearize`."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    independent: tuple[str, ...]


def linearize(model: Model, o: LinearizeOptions) -> LinearModel:
    """Linear equations about an equilibrium or a steady motion: see `Mechanism.linearize`."""
    refuse_cumulative_outputs(model, o.outputs)
    notes: tuple[str, ...] = ()
    if has_switching_elements(model):
        model, o, notes = contact_operating_point(model, o, "linearize")
    out = controlled_linear_model(model, o)[0] if model.with_states() else _smooth_linear_model(model, o)
    out.notes = (*notes, *out.notes)
    return out


def _smooth_linear_model(model: Model, o: LinearizeOptions) -> LinearModel:
    """Linear equations of a mechanism without switching elements, except friction that slides."""
    for name in o.outputs:
        single_quantity(model, name)  # refuses unknown outputs; inputs are checked where they are added
    here = model
    if o.about is None:  # only the copy with inputs is assembled
        here, named = with_inputs(model, o.inputs)
    many = None if o.independent else partial(exceeds_dense_size, DENSE_FREEDOMS)
    x = o.state(here, many)
    large = not o.independent and uses_sparse_equations(x, DENSE_FREEDOMS)
    if not large and exceeds_dense_size(DENSE_FREEDOMS, len(x.v), len(x.c.structure.rows)):
        x = o.state(here)
    if o.about is not None:
        x, named = _with_inputs(x, o.inputs)
    if not large:
        return _reduced_linear_model(x, o, named)
    whole = SparseEquations.at(x, o.frozen, _parameter_inputs(named))
    later = partial(_dense_state_space, model.snapshot(), o)
    return _linear_model(whole.e, named, o.outputs, later, sparse_descriptor(whole, named, o.outputs), None)


def controlled_linear_model(model: Model, o: LinearizeOptions) -> tuple[LinearModel, str]:
    """Linear equations of a mechanism with controllers, and their stability.

    With sampled controllers they are difference equations over one cycle.
    """
    given, o = o.outputs, replace(o, outputs=tuple(_signal_name(model, name) for name in o.outputs))
    for name in o.outputs:
        single_quantity(model, name)
    x, named = _with_inputs(o.state(model), o.inputs)
    e, f, frame, r = _checked_reduction(x, o, named)
    space, found, period = _state_space(e, f, r, named, o.outputs), spectrum(r.A, r.uncertainty), None
    which = np.flatnonzero(e.sampled)
    if len(which):
        samples = _sampled_signals(x, len(o.outputs))
        refuse_unsettled(samples, x.z[which], e.block("s")[which], state_sizes(e).change[which], model.name)
        y = np.vstack([_output_matrix(e, r, named, o.outputs), r.laws[which]])
        names = [*o.outputs, *(s.name for s in samples)]
        A, B, C, D = _matrices(r, y, named, names)
        space = replace(space, A=A, B=B, C=C, D=D)
        space, found, period = cycle_equations(space, samples, len(o.outputs))
    space = replace(space, eigenvalues=_sorted(found.values))
    descriptor = partial(dense_descriptor, e, f, frame, named, o.outputs)
    linear = _linear_model(e, named, o.outputs, space, descriptor, frame, period)
    linear.outputs = given
    return linear, stability_by_eigenvalues(found, discrete=period is not None)


def _signal_name(model: Model, name: str) -> str:
    """Full name of an output: a controller's name stands for its only output."""
    e = model.find(name)
    return f"{name}.{e.bare}" if isinstance(e, Controller) and e.bare else name


def _sampled_signals(x: MechanismState, first: int) -> list[SampledSignal]:
    """Sampled signals and states in the order of sampling; their laws are the outputs from ``first`` on."""
    out: list[SampledSignal] = []
    for k in x.c.structure.controls:
        if k.controller.sampled:
            n = x.c.values.numbers[k.controller.name]
            out.append(SampledSignal(k.name, first + len(out), (float(n.period), float(n.offset)), k.signal))
    return out


def _checked_reduction(
    x: MechanismState, o: LinearizeOptions, named: list[Input]
) -> tuple[EquationDerivatives, FreeCoordinates, TurningFrame, ReducedEquations]:
    """Equations with the constraints eliminated; inputs and outputs that have no linear equations are refused."""
    e, f, frame = _reduction_at(x, o.frozen, o.independent, to=_parameter_inputs(named))
    r = reduced_equations(e, f, frame, _input_terms(e, f, named))
    if frame.turning.any() and (named or o.outputs):
        _refuse_frame_dependence(e, f, r, frame, named, o.outputs)
    refuse_undetermined_outputs(x, o.outputs)
    return e, f, frame, r


def _reduced_linear_model(x: MechanismState, o: LinearizeOptions, named: list[Input]) -> LinearModel:
    """Linear equations with the constraints eliminated."""
    e, f, frame, r = _checked_reduction(x, o, named)
    space = _state_space(e, f, r, named, o.outputs)
    return _linear_model(e, named, o.outputs, space, partial(dense_descriptor, e, f, frame, named, o.outputs), frame)


def _dense_state_space(model: Model, o: LinearizeOptions) -> StateSpaceForm:
    """Dense state space of a large mechanism, computed only when needed."""
    x, named = _with_inputs(o.state(model), o.inputs)
    return _reduced_linear_model(x, o, named).dense


def _with_inputs(x: MechanismState, inputs: Sequence[str]) -> tuple[MechanismState, list[Input]]:
    """The same state of a copy of the model whose laws contain the inputs, and the inputs."""
    model, named = with_inputs(x.c.structure.model, inputs)
    return _in_copy(model, x) if named else x, named


def _parameter_inputs(inputs: list[Input]) -> list[str]:
    """Names of the inputs that are parameters of the model."""
    return [i.name for i in inputs if i.name == i.parameter]


def _refuse_frame_dependence(
    e: EquationDerivatives,
    f: FreeCoordinates,
    r: ReducedEquations,
    frame: TurningFrame,
    inputs: list[Input],
    outputs: Sequence[str],
) -> None:
    """Refuse inputs and outputs that do not turn with the frame, whose coefficients would change with time."""
    then, g, own = advanced_equations(e.state, f, frame)
    later = reduced_equations(then, g, own, _input_terms(then, g, inputs))
    n = len(r.rate)
    for what, names, now, other in (
        ("output", outputs, _output_matrix(e, r, inputs, outputs), _output_matrix(then, later, inputs, outputs)),
        ("input", [i.name for i in inputs], r.inputs(r.rate)[0].T, later.inputs(later.rate)[0].T),
    ):
        for k, name in enumerate(names):
            if np.abs(other[k, :n] - now[k, :n]).max(initial=0.0) > FRAME_TOLERANCE * (
                1e-300 + np.abs(now[k, :n]).max(initial=0.0)
            ):
                raise ModelError(
                    f"{what} {name!r} does not turn with the mechanism: seen in the frame in which the motion is "
                    "steady it changes with time. Take a quantity that turns with it, such as a joint's coordinate "
                    "or drive, or linearise at this instant with frozen=True"
                )


def equations_without_inputs(
    x: MechanismState, frozen: bool = False, like: FreeCoordinates | None = None
) -> tuple[FreeCoordinates, TurningFrame, ReducedEquations]:
    """Reduced linear equations at a state, in the coordinates of ``like`` if given; errors as in `linearize`."""
    e, f, frame = _reduction_at(x, frozen, like)
    return f, frame, reduced_equations(e, f, frame)


def _reduction_at(
    x: MechanismState,
    frozen: bool,
    like: FreeCoordinates | Sequence[str] | None = None,
    to: Sequence[str] = (),
) -> tuple[EquationDerivatives, FreeCoordinates, TurningFrame]:
    """Equations at a state, free coordinates (``like`` others, or by their names), and the frame."""
    if x.c.structure.controls:
        x.c.at(x.t, x.q, x.v)
        refuse_contradicting_limits(x.c, x.t)
    e = EquationDerivatives(x)
    if like is None or isinstance(like, FreeCoordinates):
        f = free_coordinates(e, like)
    else:
        f = coordinates_named(e, like) if like else free_coordinates(e)
    refuse_singular_position(e, f)
    states = np.zeros((len(x.v), e.nz))
    dq, dv = np.hstack([f.Z, 0.0 * f.Zv, states]), np.hstack([0.0 * f.Z, f.Zv, states])
    dz = np.eye(e.nz, dq.shape[1], dq.shape[1] - e.nz)
    refuse_nonsmooth(e, dq, dv, dz, to=to)
    still = np.zeros((len(x.v),) * 2)
    frame = TurningFrame(np.zeros(3), still, kinematic_matrix(x), steady=False) if frozen else steady_frame(x, e, f)
    frame.description = frame_description(x, frame, frozen)
    return e, f, frame


def _in_copy(model: Model, x: MechanismState) -> MechanismState:
    """The same state of another ``model``, a copy whose laws contain inputs."""
    c = compile_mechanism(model, parameters=x.c.parameters, tree=x.c.structure.tree)
    c.follow(x.c.hints)
    return MechanismState.moving(c, x.t, x.q, x.v)


def _input_terms(e: EquationDerivatives, f: FreeCoordinates, inputs: list[Input]) -> InputTerms:
    """Derivatives of the equations by the inputs."""
    w = input_effects(e, inputs)
    return replace(w, g=w.g[f.on_positions])


def _output_matrix(
    e: EquationDerivatives, r: ReducedEquations, inputs: list[Input], names: Sequence[str]
) -> np.ndarray:
    """Derivatives of the outputs by the states, the inputs and their rates, (outputs, n + 3 m)."""
    n = len(r.rate)
    parts = [part.T for part in (r.position, r.velocity, r.acceleration, r.multipliers, r.states)]
    out = curve_derivatives(e.state, names, parts)
    for k, i in enumerate(inputs):
        out[n + k] = curve_derivatives(
            e.state, names, [part[n + k : n + k + 1] for part in parts], values_with_input_step(e, i)
        )[0]
    return out.T


def _matrices(r: ReducedEquations, y: np.ndarray, inputs: list[Input], outputs: Sequence[str]) -> list[np.ndarray]:
    """A, B, C, D for the state in which the rates of inputs are eliminated."""
    matrices, improper = r.state_space(y)
    if improper:
        k, i, rate = improper
        raise ModelError(
            f"output {outputs[k]!r} follows the {rate} of input {inputs[i].name!r}, which no state-space model "
            f"can; leave out one of the two"
        )
    return matrices


def _sorted(w: np.ndarray) -> np.ndarray:
    """Eigenvalues sorted by size of the imaginary part, then real part; the upper one of a pair after the lower."""
    return w[np.lexsort((w.imag, w.real, np.abs(w.imag)))]


def _eigenvalues(A: np.ndarray, uncertainty: MatrixUncertainty | None) -> np.ndarray:
    return _sorted(spectrum(A, uncertainty).values)


def _state_space(
    e: EquationDerivatives, f: FreeCoordinates, r: ReducedEquations, inputs: list[Input], outputs: Sequence[str]
) -> StateSpaceForm:
    A, B, C, D = _matrices(r, _output_matrix(e, r, inputs, outputs), inputs, outputs)
    states, units = state_names(f.names, f, [x.name for x in e.state.c.structure.controls])
    return StateSpaceForm(
        A=A,
        B=B,
        C=C,
        D=D,
        states=states,
        state_units=units,
        mass=r.M,
        damping=r.D,
        stiffness=r.K,
        eigenvalues=partial(_eigenvalues, A, r.uncertainty),
        motion=r.position[:, : len(A)],
    )


def _linear_model(
    e: EquationDerivatives,
    inputs: list[Input],
    outputs: Sequence[str],
    dense: StateSpaceForm | Callable[[], StateSpaceForm],
    sparse: Descriptor | Callable[[], Descriptor],
    frame: TurningFrame | None,
    period: float | None = None,
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
        "" if frame is None else frame.description,
        period,
    )


# Quantities accumulated from the start of a motion: works and energy losses. They do not depend on the state.


CUMULATIVE_OUTPUTS_OF_ENERGY = ("balance", *CUMULATIVE_ENERGIES)
WORK = "work"


def refuse_cumulative_outputs(model: Model, names: Sequence[str]) -> None:
    """Refuse outputs of a linear model that are integrals over the motion.

    Raises
    ------
    ModelError
        With the name of the first such output.
    """
    for name in names:
        of = str(name)
        while isinstance(e := model.find(of), Sensor):
            of = e.of
        owner, what = curve_parts(of, model)
        if (
            what in CUMULATIVE_OUTPUTS_OF_ENERGY
            if owner == ENERGY
            else what == WORK and not isinstance(model.find(owner), Controller)
        ):
            instead = "energy.total" if owner == ENERGY else f"{owner}.power"
            raise ModelError(
                f"output {name!r} accumulates from the start of a motion, so it is no function of the states of a "
                f"linear model; choose {instead!r}"
            )
