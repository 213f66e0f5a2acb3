"""Sensitivities: exact derivatives of kinematics, reactions, equilibria, eigenvalues and motions by parameters.

Eigenvalues are those in the described position or at the equilibrium, with controllers. The system matrix is exact.
Its derivatives are differences of sixth order; then dw = y^H dA x / y^H x (Lancaster 1964), with groups of equal
eigenvalues treated together. Sampled controllers are supported.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis_options import AnalysisOptions, require_positive
from ..assembly.assemble import assemble
from ..assembly.compiled_mechanism import CompiledMechanism
from ..derivatives.eigenvalues import EQUAL_TOLERANCE, MAX_SPLITTING, equal_groups, invariant_subspace
from ..derivatives.equation_derivatives import EquationDerivatives, MechanismState, values_with_complex_step
from ..derivatives.nonsmooth_points import refuse_nonsmooth
from ..derivatives.output_derivatives import (
    curve_derivatives,
    curve_derivatives_over_time,
    depend_on_reactions,
    refuse_undetermined_outputs,
    snapshot,
)
from ..errors import ModelError, SingularityError
from ..linear.linearize import LinearizeOptions, controlled_linear_model, equations_without_inputs
from ..linear.operating_point import operating_state
from ..model.element_laws import refuse_jumping_laws, refuse_jumping_rates
from ..model.model import Model, listing, suggest
from ..model.quantities import single_quantity
from ..model.unsupported_elements import refuse_controllers, refuse_unsupported
from ..results.linear_model import sort_branches
from ..results.result import Result
from ..results.sensitivity_and_optimum import Sensitivity
from ..simulation.initial_state import find_initial_state, refuse_unknown_coordinates
from ..simulation.integration_options import default_integration, output_times
from ..simulation.law_faults import refuse_out_of_table
from ..simulation.method_choice import SimulateOptions
from ..simulation.simulate import clock_for, simulate
from ..statics.equilibrium import LINEARIZE_DEFAULTS, determined_rest, equilibrium, rest_options
from ..statics.stability import RestState
from ..tables.coordinate_choice import rotors
from ..tables.values import Values
from .parameter_derivatives import (
    ConstrainedSystem,
    DerivativeRequest,
    ParameterDirection,
    ParameterFunction,
    StateDerivative,
    changes_in_motion_coordinates,
    difference_derivative,
    initial_changes,
    initial_state_changes,
    initial_state_derivatives,
    is_fully_driven,
    offset_sample,
    parameter_scale,
    reaction_friction,
    small_step_derivative,
)
from .variational_equations import MotionSensitivity, VariationalIntegration, prescribed_motion_sensitivity


def eigenvalue_sensitivity(a: DerivativeRequest) -> Sensitivity:
    """Eigenvalues and their derivatives; with sampled controllers the multipliers of one cycle."""
    matrix, unit = _system_matrix(a)
    base = matrix(a.parameters)
    units = entry_units(base)
    dA = np.array([difference_derivative(a.model, a.parameters, name, matrix, units) for name in a.to])
    w, dw = eigenvalue_derivatives(
        base, dA.reshape(len(a.to), *base.shape), lambda k: offset_sample(a.model, a.parameters, a.to[k], matrix)
    )
    of = tuple(f"eigenvalue {k}" for k in range(len(w)))
    return Sensitivity("modes", of, a.to, (unit,) * len(of), {}, np.array([a.t]), w[None], dw[None])


def entry_units(A: np.ndarray) -> np.ndarray:
    """Magnitudes (n, n) in which the entries of a system matrix are comparable: T_i / T_j of the balanced T^-1 A T."""
    from scipy.linalg import matrix_balance

    if not A.size:
        return np.ones_like(A)
    scale = matrix_balance(A, permute=False, separate=True)[1][0]
    return np.outer(scale, 1.0 / scale)


def eigenvalue_function(a: DerivativeRequest) -> ParameterFunction:
    """Function that returns the eigenvalues for any parameters, in the order of the initial ones."""
    matrix, _ = _system_matrix(a)
    A = matrix(a.parameters)
    first, _ = eigenvalue_derivatives(A, np.zeros((0, *A.shape)))

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        return sort_branches(np.array([first, np.linalg.eigvals(matrix(parameters)).astype(complex)]))[1]

    return found


def _system_matrix(a: DerivativeRequest) -> tuple[ParameterFunction, str]:
    """Function for the system matrix, in fixed free coordinates; and the unit of eigenvalues."""
    if any(e.sampled for e in a.model.controllers):
        return _cycle_matrix(a), ""
    about = _equilibrium_by_parameters(a)
    coordinates = "joint" if rotors(a.model) else "absolute"

    def state(parameters: Mapping[str, float]) -> MechanismState:
        return operating_state(a.model, about(parameters), t=a.t, parameters=parameters, coordinates=coordinates)[0]

    begin = state(a.parameters)
    f, _, _ = equations_without_inputs(begin)
    refuse_nonsmooth(EquationDerivatives(begin), *np.zeros((2, len(begin.v), 1)), to=a.to)
    return lambda parameters: equations_without_inputs(state(parameters), like=f)[2].A, "1/s"


def _cycle_matrix(a: DerivativeRequest) -> ParameterFunction:
    """Function for the matrix over one cycle of sampled controllers."""
    about = _equilibrium_by_parameters(a)
    coordinates = "joint" if rotors(a.model) else "absolute"

    def linear(parameters: Mapping[str, float]) -> Any:
        place = about(parameters)
        given = {"about": place, "t": None if place else a.t, "parameters": parameters, "coordinates": coordinates}
        return controlled_linear_model(a.model, LinearizeOptions(**(LINEARIZE_DEFAULTS | given)))[0]

    first = linear(a.parameters)

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        now = linear(parameters)
        if now.states != first.states:
            raise ModelError(f"the states there are {', '.join(now.states)}, and were {', '.join(first.states)}")
        return now.A

    return found


def _equilibrium_by_parameters(a: DerivativeRequest) -> Callable[[Mapping[str, float]], Any]:
    """Function for the equilibrium at any parameters, near the first; None where the described position is used."""
    begin: list[Any] = []

    def about(parameters: Mapping[str, float]) -> Any:
        if a.about != "equilibrium":
            return None
        begin.append(equilibrium(a.model, rest_options(a.t, parameters, begin[0] if begin else None)))
        return begin.pop() if len(begin) > 1 else begin[0]

    return about


# Derivatives of the eigenvalues of a matrix: dw = y^H dA x / y^H x (Lancaster 1964), groups of equal ones together.
#
# If an eigenvalue is repeated with as many eigenvectors, its first-order changes are the eigenvalues of dA in their
# subspace. If it has fewer eigenvectors, it has no derivative, unless all stay zero: a mechanism that can move as a
# whole has two zero eigenvalues and keeps them. A finite step of the parameter checks whether they stay zero.


MATRIX_ROUNDING = 100.0 * np.finfo(float).eps  # uncertainty of the matrix, relative to its norm
IDENTITY_TOLERANCE = 1e-6  # difference of a group from a multiple of the identity, relative to the norm
# Eigenvalues that moved less than this part of the change by dA in a finite step have stayed.
STAYED_FRACTION = 1e-3

OffsetSample = Callable[[int], tuple[float, np.ndarray, str]]


def eigenvalue_derivatives(
    A: np.ndarray, dA: np.ndarray, aside: OffsetSample | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues and their derivatives.

    Parameters
    ----------
    A : ndarray (n, n)
    dA : ndarray (k, n, n)
        Derivatives of A by k parameters.
    aside : callable
        Returns for the k-th parameter a finite step, A at the stepped value, and the parameter's name.

    Returns
    -------
    w : ndarray (n,)
        Eigenvalues sorted by magnitude, then imaginary part, then real part.
    dw : ndarray (n, k)

    Raises
    ------
    SingularityError
        If an eigenvalue has no derivative.
    """
    from scipy.linalg import eig, matrix_balance

    if not len(A):
        return np.zeros(0, complex), np.zeros((0, len(dA)), complex)
    B, (scale, _) = matrix_balance(A, permute=False, separate=True)
    dB = dA / scale[:, None] * scale
    w, left, right = eig(B, left=True)
    order = _in_order(w)
    w, left, right = w[order], left[:, order], right[:, order]
    size = float(np.linalg.norm(B, 2)) or 1.0
    out = np.zeros((len(w), len(dA)), complex)
    angle = np.abs((left.conj() * right).sum(axis=0))
    for group in equal_groups(
        w, size * np.clip(MATRIX_ROUNDING / np.maximum(angle, 1e-300), EQUAL_TOLERANCE, MAX_SPLITTING)
    ):
        if len(group) == 1:
            y, x = left[:, group[0]], right[:, group[0]]
            out[group[0]] = np.array([y.conj() @ d @ x for d in dB]) / (y.conj() @ x)
        else:
            out[group] = _group_derivatives(B, dB, w, group, size, scale, aside)
    return w.astype(complex), out


def _in_order(w: np.ndarray) -> np.ndarray:
    """Indices that sort eigenvalues by magnitude, equal but for rounding or not, imaginary part, and real part."""
    size = np.abs(w)
    order, distinct = np.argsort(size), np.zeros(len(w), int)
    distinct[order] = np.cumsum(np.diff(size[order], prepend=0.0) > EQUAL_TOLERANCE * size[order])
    return np.lexsort((w.real, w.imag, distinct))


def _group_derivatives(
    B: np.ndarray,
    dB: np.ndarray,
    w: np.ndarray,
    group: list[int],
    size: float,
    scale: np.ndarray,
    aside: OffsetSample | None,
) -> np.ndarray:
    """Derivatives of equal eigenvalues, (group, k)."""
    V, W = (invariant_subspace(X, v) for X, v in ((B, w[group]), (B.conj().T, w[group].conj())))
    inner = np.linalg.inv(W.conj().T @ V)
    own = inner @ (W.conj().T @ B @ V)
    plain = np.abs(own - np.trace(own) / len(group) * np.eye(len(group))).max() <= IDENTITY_TOLERANCE * size
    out = np.zeros((len(group), len(dB)), complex)
    for k, d in enumerate(dB):
        inside = inner @ (W.conj().T @ d @ V)
        if plain:
            found = np.linalg.eigvals(inside)
            out[:, k] = found[np.lexsort((found.imag, found.real))]
        elif aside is not None:
            h, other, name = aside(k)
            value, spread = complex(np.mean(w[group])), float(np.abs(w[group]).max())
            then = np.abs(np.linalg.eigvals(other / scale[:, None] * scale))
            moved = np.sort(then)[: len(group)].max()  # as many as are zero now
            stayed = moved <= max(
                STAYED_FRACTION * h * np.abs(inside).max(), 10.0 * spread, np.sqrt(MATRIX_ROUNDING) * size
            )
            if abs(value) <= np.sqrt(MATRIX_ROUNDING) * size and stayed:
                continue
            raise SingularityError(
                f"the eigenvalue {value.real:.4g}{value.imag:+.4g}j 1/s is {len(group)}-fold and has fewer "
                f"eigenvectors: it has no derivative with respect to {name!r}. Choose a value slightly different from "
                "this one"
            )
    return out


LEAST_STIFFNESS_RATIO = 1e-8  # relative stiffness below which the position of an equilibrium is not determined


MOTION_DEFAULTS = {"outputs": 51, "rtol": 1e-9, "atol": 1e-11}  # defaults of a motion


@dataclass(frozen=True, kw_only=True)
class DerivativeOptions(AnalysisOptions):
    """Options of derivatives: quantities, parameters, and the analysis that relates them."""

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
                raise ModelError(f"{name} applies to a motion; with analysis={self.analysis!r} it has no effect")
        if self.analysis == "motion" and self.t_end is None:
            raise ModelError("sensitivity of a motion: give t_end")
        refuse_unknown_coordinates(self.coordinates)
        if self.coordinates != "auto" and self.analysis != "motion":
            raise ModelError(f"coordinates apply to a motion; with analysis={self.analysis!r} they have no effect")
        for name in ("rtol", "atol"):
            if getattr(self, name) is not None:
                require_positive(getattr(self, name), name)
        if self.about is not None and self.analysis != "modes":
            raise ModelError(f"about is for modes; with analysis={self.analysis!r} it has no effect")
        if self.about not in (None, "equilibrium"):
            raise ModelError(f"about must be 'equilibrium' or nothing, got {_value_text(self.about)}")

    def of_motion(self, name: str) -> Any:
        """An option of a motion, or its default."""
        value = getattr(self, name)
        return MOTION_DEFAULTS[name] if value is None else value


@dataclass(frozen=True, kw_only=True)
class SensitivityOptions(DerivativeOptions):
    """Arguments of `Mechanism.sensitivity`."""

    of: tuple[str, ...]
    to: tuple[str, ...]
    verify: bool

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.of and self.analysis != "modes":
            raise ModelError("give the quantities: of=['slider.x'], for instance")


def sensitivity(model: Model, o: SensitivityOptions) -> Sensitivity:
    """Derivatives of quantities with respect to parameters: see `Mechanism.sensitivity`."""
    if model.with_states():
        return _with_controllers(model, o)
    return _computed_sensitivity(model, o)


def _computed_sensitivity(model: Model, o: SensitivityOptions) -> Sensitivity:
    a = _checked_question(model, o)
    out = ANALYSES[o.analysis][0](a)
    env = model.environment(o.parameters)
    out.parameters = {name: env[name] for name in a.to}
    return _with_verification(a, o.analysis, out) if o.verify else out


def _checked_question(model: Model, o: SensitivityOptions) -> DerivativeRequest:
    """Check the names of quantities and parameters and build the request."""
    refuse_unsupported(model, "sensitivity", controlled=True)
    env = model.environment(o.parameters)
    for name in o.to:
        if name not in env:
            raise ModelError(
                f"{model.name!r} has no parameter {name!r}{suggest(name, list(env))}; {listing(list(env))}"
            )
    for name in o.of if o.analysis != "modes" else ():
        single_quantity(model, name)
    if not env:
        raise ModelError(f"{model.name!r} has no parameters to take derivatives by; give it some: parameters={{...}}")
    return DerivativeRequest(
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


def _with_controllers(model: Model, o: SensitivityOptions) -> Sensitivity:
    """Sensitivity of a mechanism with controllers."""
    if o.analysis not in ("motion", "equilibrium", "modes") or model.events:
        refuse_controllers(
            model, f"sensitivity with analysis={o.analysis!r}" + (", with events," if model.events else "")
        )
    if o.analysis != "motion":
        return _computed_sensitivity(model, o)
    refuse_jumping_rates(model, _checked_question(model, o).to)
    return _computed_sensitivity(model, o)


def _refuse_moving_instants(c: CompiledMechanism, values: Mapping[str, Values]) -> None:
    """Refuse parameters that shift sampling instants."""
    for e in (e for e in c.structure.model.controllers if e.sampled):
        for name, x in values.items():
            n = x.numbers[e.name]
            if np.imag(n.period) != 0.0 or np.imag(n.offset) != 0.0:
                raise ModelError(
                    f"{e.title}: its instants depend on {name!r}, and the sensitivity of a motion does not follow a "
                    f"shift of instants; take differences of m.simulate(parameters=...)"
                )


def _with_verification(a: DerivativeRequest, analysis: str, out: Sensitivity) -> Sensitivity:
    """Add the derivatives by central differences for comparison."""
    again = ANALYSES[analysis][1](a)
    parts = [small_step_derivative(a.model, a.parameters, name, again) for name in a.to]
    out.verification = np.stack([x.reshape(out.values.shape) for x in parts], axis=-1)
    return out


def _value_text(value: Any) -> str:
    """Text for a value in a message: a string as it is, else its type."""
    return repr(value) if isinstance(value, (str, float, int)) else f"a {type(value).__name__}"


def _curve_values(x: MechanismState, names: Sequence[str]) -> np.ndarray:
    """Values of curves at one state."""
    shot = snapshot(x)
    return np.array([float(shot.curve(name)[1][0]) for name in names])


def _curve_units(x: MechanismState, names: Sequence[str]) -> tuple[str, ...]:
    shot = snapshot(x)
    return tuple(shot.curve(name)[0] for name in names)


def _derivative_columns(
    a: DerivativeRequest,
    x: MechanismState,
    directions: Sequence[ParameterDirection],
    tangents: Sequence[StateDerivative],
) -> np.ndarray:
    """Derivatives of the quantities at a state, (of, to)."""
    refuse_undetermined_outputs(x, a.of)
    return np.array(
        [curve_derivatives(x, a.of, d.parts, k.values)[0] for k, d in zip(directions, tangents, strict=True)]
    ).T


def _instant_sensitivity(a: DerivativeRequest) -> Sensitivity:
    base = assemble(a.model, t=a.t, parameters=a.parameters)
    x = MechanismState.moving(base.compiled, base.t, base.q, base.v)
    e = EquationDerivatives(x)
    directions = [ParameterDirection(e, name) for name in a.to]
    tangents = initial_state_derivatives(a.model, a.parameters, base, x, directions)
    _refuse_kinks(a, e, tangents)
    found = _derivative_columns(a, x, directions, tangents)
    return Sensitivity(
        "instant", a.of, a.to, _curve_units(x, a.of), {}, np.array([a.t]), _curve_values(x, a.of)[None], found[None]
    )


def _refuse_kinks(a: DerivativeRequest, e: EquationDerivatives, tangents: Sequence[StateDerivative]) -> None:
    """Refuse forces without a derivative along the changes by the parameters, or by a parameter."""
    none = np.zeros((len(e.state.v), 1))
    dq, dv = (np.column_stack([none, *ways]) for ways in ([k.q for k in tangents], [k.v for k in tangents]))
    dz = np.column_stack([np.zeros((e.nz, 1)), *(k.z for k in tangents)])
    refuse_nonsmooth(e, dq, dv, dz, to=a.to)


def _instant_function(a: DerivativeRequest) -> ParameterFunction:
    def found(parameters: Mapping[str, float]) -> np.ndarray:
        b = assemble(a.model, t=a.t, parameters=parameters)
        return _curve_values(MechanismState.moving(b.compiled, b.t, b.q, b.v), a.of)

    return found


def _motion_sensitivity(a: DerivativeRequest) -> Sensitivity:
    begun = find_initial_state(a.model, a.t, a.parameters, None, a.coordinates)
    base, layer = begun.base, begun.assembly.compiled
    refuse_out_of_table(base, float(a.times[-1]))
    # Positions and velocities change as the constraints allow; the accelerations at the start do not matter.
    x = MechanismState.moving(base.compiled, base.t, base.q, base.v, rotors=False)
    e = EquationDerivatives(x)
    directions = [ParameterDirection(e, name) for name in a.to]
    values = [d.values if layer is base.compiled else values_with_complex_step(layer, d.name) for d in directions]
    driven, lin = is_fully_driven(base), ConstrainedSystem(x)
    if layer.structure.loads:
        reaction_friction(x, lin.G)
    _refuse_moving_instants(layer, dict(zip(a.to, values, strict=True)))
    if not driven:
        refuse_jumping_laws(a.model, a.to)
        _refuse_kinks(a, e, ())
    pairs = initial_changes(a.model, a.parameters, base, x, directions, lin)
    start = [
        (*changes_in_motion_coordinates(begun, *of), initial_state_changes(of[0]))
        for of in zip(directions, values, pairs, strict=True)
    ]
    clock = clock_for(begun, a.t, float(a.times[-1]), a.times, default_integration(a.coordinates, a.rtol, a.atol))
    loop = VariationalIntegration(begun, clock, values, [parameter_scale(a.model, a.parameters, name) for name in a.to])
    varied = (
        prescribed_motion_sensitivity(loop)
        if driven
        else loop.run(*(np.array(part) for part in zip(*start, strict=True)))
    )
    motion = varied.result(begun)
    _refuse_undetermined(layer, varied, a.of)
    found = [motion.curve(name) for name in a.of]
    by = [curve_derivatives_over_time(motion, a.of, v, c.parts, c.z) for v, c in zip(values, varied.by, strict=True)]
    units = tuple(unit for unit, _ in found)
    return Sensitivity(
        "motion", a.of, a.to, units, {}, a.times, np.array([x for _, x in found]).T, np.stack(by, axis=-1)
    )


def _refuse_undetermined(c: CompiledMechanism, varied: MotionSensitivity, of: Sequence[str]) -> None:
    """Refuse quantities that redundant constraints leave undetermined at one of the times."""
    m = varied.motion
    for k, t in enumerate(varied.t.tolist()):
        c.z[:] = m.z[k]
        state = MechanismState.moving(c, t, m.q[k], m.v[k])
        if k == 0 and not depend_on_reactions(state, of):
            return
        refuse_undetermined_outputs(state, of)


def _simulated(
    a: DerivativeRequest, times: np.ndarray, parameters: Mapping[str, float], coordinates: str, rtol: float, atol: float
) -> Result:
    """Simulate the motion at the given times."""
    asked = SimulateOptions(
        t_end=float(times[-1]),
        t_start=a.t,
        outputs=times.tolist(),
        parameters=parameters,
        start=None,
        specialize=False,  # differences of motions require the same engine for all
        progress=False,
        **default_integration(coordinates, rtol, atol).choices(),
    )
    return simulate(a.model, asked)


def _motion_function(a: DerivativeRequest) -> ParameterFunction:
    def found(parameters: Mapping[str, float]) -> np.ndarray:
        r = _simulated(a, a.times, parameters, "auto", 1e-12, 1e-13)
        return np.stack([r.curve(name)[1] for name in a.of], axis=1)

    return found


def _equilibrium_sensitivity(a: DerivativeRequest) -> Sensitivity:
    found = equilibrium(a.model, rest_options(a.t, a.parameters))
    b = found.assembly
    if a.model.with_states():  # controller states are unknowns, too
        return _sensitivity_at_rest(a, determined_rest(b))
    if abs(found.least) < LEAST_STIFFNESS_RATIO:
        weak = ", ".join(found.weakest)
        raise SingularityError(
            f"the equilibrium of {a.model.name!r} has no stiffness along {weak}: its position is not determined, so "
            "it has no derivatives; add a spring or a driver there",
            a.t,
            tuple(found.weakest),
        )
    return _sensitivity_at_rest(a, RestState.at(b.compiled, b.t, b.q))


def _sensitivity_at_rest(a: DerivativeRequest, rest: RestState) -> Sensitivity:
    """Sensitivity by the equations at rest: changes of positions and multipliers compensate those by parameters."""
    x = rest.equations.state
    directions, tangents = [ParameterDirection(rest.equations, name) for name in a.to], []
    still = np.zeros(len(x.v))
    for d in directions:
        left = d.along(x, still, still)
        change, lam = rest.solved(np.r_[left[d.e.at["r"]], -left[d.e.at["s"]]], left[d.e.at["g"]])
        q, z = np.split(change, [len(still)])
        tangents.append(StateDerivative(q, still, still, lam, z))
    _refuse_kinks(a, rest.equations, tangents)
    column = _derivative_columns(a, x, directions, tangents)
    return Sensitivity(
        "equilibrium",
        a.of,
        a.to,
        _curve_units(x, a.of),
        {},
        np.array([a.t]),
        _curve_values(x, a.of)[None],
        column[None],
    )


def _equilibrium_function(a: DerivativeRequest) -> ParameterFunction:
    begin = equilibrium(a.model, rest_options(a.t, a.parameters))

    def found(parameters: Mapping[str, float]) -> np.ndarray:
        b = equilibrium(a.model, rest_options(a.t, parameters, begin))
        return _curve_values(
            MechanismState.resting(b.assembly.compiled, a.t, b.assembly.q, b.result.multipliers[0]), a.of
        )

    return found


# analysis -> (computes the derivatives, returns a function of the parameters for differences)
ANALYSES: dict[
    str, tuple[Callable[[DerivativeRequest], Sensitivity], Callable[[DerivativeRequest], ParameterFunction]]
] = {
    "instant": (_instant_sensitivity, _instant_function),
    "motion": (_motion_sensitivity, _motion_function),
    "equilibrium": (_equilibrium_sensitivity, _equilibrium_function),
    "modes": (eigenvalue_sensitivity, eigenvalue_function),
}
