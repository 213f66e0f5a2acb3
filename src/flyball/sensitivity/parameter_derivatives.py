"""Derivatives by parameters: of a state and the initial state, and of any quantity by differences.

Central differences are of sixth order for a derivative, of second order for a check. The step starts as a part of the
parameter and is reduced or increased until the differences of sixth and of fourth order agree best.

For a change (dq, dv, dp) of positions, velocities and a parameter, one complex step through the residuals gives the
exact changes of the constraints and the equations of motion. Accelerations and multipliers follow from

    M dvdot + (F - G^T) dlam = -(r along (dq, dv, dp)),    G dvdot = -(a along (dq, dv, dp))

F is the dependence of joint friction on reactions. If drivers leave no freedom, the constraints alone determine the
change of the initial state. Otherwise the initial state is the described positions and velocities, moved onto the
constraints by minimum-norm steps, and its changes follow likewise. If assembly moved the mechanism farther, its result
is differenced.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..assembly.assemble import assemble
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import compile_mechanism, tangent_rate, tangent_step
from ..assembly.positions_and_velocities import (
    VelocityEquations,
    described_velocities,
    inverse_weights,
    row_scales,
    velocity_deviation,
)
from ..compiler.kernels import StructBuffer
from ..derivatives.equation_derivatives import (
    COMPLEX_STEP,
    EquationDerivatives,
    MechanismState,
    complex_step_derivative,
    complex_system,
    friction_by_multipliers,
    refuse_undetermined_friction,
)
from ..derivatives.equation_derivatives import COMPLEX_STEP as COMPLEX
from ..engine.entry_point import pooled_work
from ..engine.kinematics import BodyKinematicsOverTime, joint_velocities, retract
from ..errors import AnalysisError, ModelError
from ..model.model import Model
from ..numerics.rank import RANK_TOLERANCE
from ..results.motion_record import RecordedMotion
from ..simulation.initial_state import InitialState
from ..simulation.prescribed_motion import leaves_no_freedom
from ..tables.law_inputs import initial_controller_states
from ..tables.reference_configuration import BodyState, positions
from ..tables.structure_definition import velocity_names
from ..tables.table_definitions import named_arrays
from ..tables.values import Values, values


@dataclass
class DerivativeRequest:
    """Quantities, parameters and operating point of a derivative computation."""

    model: Model
    of: tuple[str, ...]
    to: tuple[str, ...]
    t: float
    parameters: dict[str, float]
    times: np.ndarray
    about: str | None
    rtol: float
    atol: float
    coordinates: str


DIFFERENCE_STEP, CHECK_STEP = 2e-3, 1e-5  # relative to the parameter
SIXTH_ORDER = np.array([0.75, -0.15, 1.0 / 60.0])
FOURTH_ORDER = np.array([2.0 / 3.0, -1.0 / 12.0, 0.0])
AGREEMENT = 1e-9  # relative to the derivative
DIFFERENCE_ROUNDING = 1e-11  # relative to the differenced values
MAX_STEP_CHANGES = 7

ParameterFunction = Callable[[Mapping[str, float]], np.ndarray]


def difference_derivative(
    model: Model, parameters: Mapping[str, float], name: str, found: ParameterFunction, units: np.ndarray
) -> np.ndarray:
    """Derivative by a parameter of a function of the parameters, by differences of sixth order.

    ``units`` are magnitudes in which the function's numbers are comparable: the step is the best one for all of them.

    Raises
    ------
    AnalysisError, ModelError
        The error of the function, if it fails with every step size.
    """
    value = model.environment(parameters)[name]

    def at(h: float) -> tuple[float, np.ndarray, bool]:
        sides = [[found({**parameters, name: value + s * k * h}) for s in (1, -1)] for k in (1, 2, 3)]
        D = np.array([a - b for a, b in sides])
        best, other = (np.tensordot(weights, D, 1) / h for weights in (SIXTH_ORDER, FOURTH_ORDER))
        error, size = (float(np.abs(X / units).max(initial=0.0)) for X in (best - other, best))
        largest = max(float(np.abs(a / units).max(initial=0.0)) for pair in sides for a in pair)
        if error <= AGREEMENT * size:
            error = 0.0
        return error, best, error * h <= DIFFERENCE_ROUNDING * largest

    h = DIFFERENCE_STEP * parameter_scale(model, parameters, name)
    best: tuple[float, np.ndarray] | None = None
    way = 0.1
    for _ in range(MAX_STEP_CHANGES):
        try:
            error, found_, rounded = at(h)
        # ModelError: the model is invalid with so large a change of the parameter.
        except (AnalysisError, ModelError) as error_:
            # The quantity does not exist at other values: a smaller step does not help.
            if type(error_) is AnalysisError:
                raise AnalysisError(f"a little to the side of {name!r} = {value:g}, {error_}") from None
            if way > 1.0:
                break
            h *= way
            continue
        better = best is None or error < best[0]
        if better:
            way = 10.0 if best is None and rounded else way
            best = error, found_
        if error == 0.0 or (rounded and way < 1.0) or (not better and way > 1.0):
            break
        h *= way
    return at(h)[1] if best is None else best[1]


def offset_sample(
    model: Model, parameters: Mapping[str, float], name: str, found: ParameterFunction
) -> tuple[float, np.ndarray, str]:
    """The first step of the differences, the function's value at that step, and the parameter's name."""
    h = DIFFERENCE_STEP * parameter_scale(model, parameters, name)
    return h, found({**parameters, name: model.environment(parameters)[name] + h}), name


def small_step_derivative(
    model: Model, parameters: Mapping[str, float], name: str, found: ParameterFunction
) -> np.ndarray:
    """Like `difference_derivative`, by one central difference of second order with a small step."""
    value = model.environment(parameters)[name]
    h = CHECK_STEP * parameter_scale(model, parameters, name)
    return (found({**parameters, name: value + h}) - found({**parameters, name: value - h})) / (2.0 * h)


def parameter_scale(model: Model, parameters: Mapping[str, float], name: str) -> float:
    """Magnitude of the parameter; if it is zero, the change that changes something in the mechanism by its full size.

    Positions are compared with the mechanism's length, other numbers with the largest of their kind.
    """
    value = float(np.real(model.environment(parameters)[name]))
    if value:
        return abs(value)
    c = compile_mechanism(model, parameters=parameters)
    v = values(c.structure, {**c.parameters, name: complex(value, COMPLEX)})
    length = c.values.length
    scales = [(v.system.frames.position, length)]
    places = np.array([n.unit == "m" for n in velocity_names(c.structure)])
    scales += [(v.v[places], length), (v.v[~places], 1.0), (v.q, length)]
    for table in ("bodies", "term_parameters", "force_parameters", "gravity", "units"):
        for _, x in named_arrays(getattr(v.system, table)):
            columns = np.atleast_2d(x.T)
            scales += [(x, np.abs(x.real).max()) for x in columns if len(x) and np.abs(x.real).max() > 0.0]
    effect = max((float(np.abs(np.imag(x)).max(initial=0.0)) / COMPLEX / s for x, s in scales), default=0.0)
    return 1.0 / effect if effect > 0.0 else 1.0


# A parameter is refused if more than this part of the gaps that it opens remains after the best motion.
REMAINING_GAP = 1e-7
# Gaps below this, relative to the mechanism's length or a radian, for a full change of the parameter count as zero.
GAP_ROUNDING = 1e-9


@dataclass
class StateDerivative:
    """Changes per unit of a parameter.

    Of positions along the velocities, of velocities, accelerations, multipliers and controller states.
    """

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray
    lam: np.ndarray
    z: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def parts(self) -> tuple[np.ndarray, ...]:
        """The changes as rows, for `output_derivatives.curve_derivatives`."""
        return self.q[None], self.v[None], self.vdot[None], self.lam[None], self.z[None]


class ParameterDirection:
    """A parameter's complex step in the tables, and the residuals along it at any state."""

    def __init__(self, e: EquationDerivatives, name: str) -> None:
        self.name = name
        self.values: Values = e.stepped(name)
        system = complex_system(self.values.system)
        self.tables = StructBuffer(system), pooled_work(e.state.c.structure, system, complex)
        self.e = e

    @staticmethod
    def derivative(x: np.ndarray) -> np.ndarray:
        """Derivative by the parameter of numbers that contain its complex step."""
        return complex_step_derivative(x)

    def along(self, x: MechanismState, dq: np.ndarray, dv: np.ndarray) -> np.ndarray:
        """Derivatives (width,) of all residuals at x along changes of positions, velocities and the parameter."""
        steps = 1j * COMPLEX_STEP * np.r_[dq, dv, np.zeros(len(dq) + 1 + self.e.nz)][None]
        return complex_step_derivative(self.e.residuals(x, steps, *self.tables)[0])


class ConstrainedSystem:
    """Mass matrix and constraints at a state, factorised for solutions."""

    def __init__(self, x: MechanismState, M: np.ndarray | None = None) -> None:
        c = x.c
        c.at(x.t, x.q, x.v)
        self.x = x
        self.G = c.jacobian()
        self.M = c.mass().toarray() if M is None else M
        self.which = np.array([r.holonomic for r in c.structure.rows], bool)
        inertia = np.diag(self.M) * c.sizes**2
        self.scale = c.sizes / np.sqrt(np.where(inertia > 0.0, inertia, inertia.max(initial=0.0) or 1.0))
        n, m = len(self.M), len(self.G)
        self.A = np.zeros((n + m, n + m))
        S = self.scale
        self.A[:n, :n] = S[:, None] * self.M * S
        H = self.G * S
        self.size = 1.0 / np.maximum(np.sqrt((H * H).sum(axis=1)), 1e-300)
        self.H = self.size[:, None] * H
        self.A[:n, n:], self.A[n:, :n] = -self.H.T, self.H
        self._inverses: dict[bytes, np.ndarray] = {}

    @cached_property
    def inverse(self) -> np.ndarray:
        """Pseudo-inverse of the equations of motion with the constraints; rows may be redundant."""
        A = self.A
        if self.x.c.structure.loads:
            n, F = len(self.M), reaction_friction(self.x, self.G)
            A = A.copy()
            A[:n, n:] += self.scale[:, None] * F * self.size
        return np.linalg.pinv(A, rcond=1e-12)

    def motion(self, right: np.ndarray, which: np.ndarray | None = None) -> np.ndarray:
        """The change x with G x = right that is smallest in kinetic energy."""
        rows = np.ones(len(self.H), bool) if which is None else which
        key = rows.tobytes()
        if key not in self._inverses:
            self._inverses[key] = np.linalg.pinv(self.H[rows], rcond=RANK_TOLERANCE) if rows.any() else self.H[rows].T
        return self.scale * (self._inverses[key] @ (self.size * right)[rows])

    def acceleration(self, r: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(dvdot, dlam) that cancel the residuals of the equations of motion and of the constraints."""
        n = len(self.M)
        x = self.inverse @ -np.r_[self.scale * r, self.size * a]
        return self.scale * x[:n], self.size * x[n:]


def reaction_friction(x: MechanismState, G: np.ndarray) -> np.ndarray:
    """Derivatives F (nv, rows) of joint friction by the reactions; refused where these are undetermined."""
    s = x.c.structure
    F = friction_by_multipliers(x)
    scale = x.c.sizes / x.c.values.length
    refuse_undetermined_friction(s, G * scale, scale[:, None] * F)
    return F


def consistent_changes(
    d: ParameterDirection, x: MechanismState, lin: ConstrainedSystem, dq: np.ndarray, dv: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The changes of positions and velocities nearest to the given ones that keep the constraints.

    Raises
    ------
    ModelError
        If there are none: the mechanism cannot be assembled with another value of the parameter.
    """
    at = d.e.at
    before = d.along(x, dq, dv)[at["g"]]
    dq = dq + lin.motion(-before, lin.which)
    left = d.along(x, dq, dv)
    _refuse_inconsistent(d, x, np.abs(before), np.abs(left[at["g"]]))
    return dq, dv + lin.motion(-left[at["n"]])


def _refuse_inconsistent(d: ParameterDirection, x: MechanismState, before: np.ndarray, remaining: np.ndarray) -> None:
    """Refuse a parameter whose change opens gaps (rows,) that no motion closes."""
    c = x.c
    before, remaining = before / c.row_units, remaining / c.row_units
    rounding = GAP_ROUNDING / parameter_scale(c.structure.model, c.parameters, d.name)
    if remaining.max(initial=0.0) > max(REMAINING_GAP * before.max(initial=0.0), rounding):
        names = dict.fromkeys(
            r.element.name for r, g in zip(c.structure.rows, remaining, strict=True) if g > 0.1 * remaining.max()
        )
        raise ModelError(
            f"{c.structure.model.name!r} cannot be assembled with another {d.name!r}: {', '.join(names)} would "
            f"contradict each other (redundant joints, or a singular position), so nothing has a derivative by it. Let "
            f"what else has to fit follow the parameter, or take the redundancy out: m.mobility() names it"
        )


def consistent_derivative(
    d: ParameterDirection, x: MechanismState, lin: ConstrainedSystem, dq: np.ndarray, dv: np.ndarray
) -> StateDerivative:
    """State derivative whose position and velocity changes are nearest to the given ones and keep the constraints."""
    at = d.e.at
    dq, dv = consistent_changes(d, x, lin, dq, dv)
    left = d.along(x, dq, dv)
    return StateDerivative(dq, dv, *lin.acceleration(left[at["r"]], left[at["a"]]))


DESCRIBED_TOLERANCE = (
    1e-12  # difference of the start from the description, relative to the length or the largest velocity
)


def initial_state_derivatives(
    model: Model,
    parameters: Mapping[str, float],
    base: Assembly,
    x: MechanismState,
    directions: Sequence[ParameterDirection],
) -> list[StateDerivative]:
    """Derivatives of the initial state by each parameter, with accelerations and multipliers; see `initial_changes`."""
    lin = ConstrainedSystem(x)
    pairs = initial_changes(model, parameters, base, x, directions, lin)
    return [consistent_derivative(d, x, lin, *pair) for d, pair in zip(directions, pairs, strict=True)]


def initial_changes(
    model: Model,
    parameters: Mapping[str, float],
    base: Assembly,
    x: MechanismState,
    directions: Sequence[ParameterDirection],
    lin: ConstrainedSystem,
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Derivatives of the initial positions and velocities by each parameter.

    Parameters
    ----------
    model : Model
    parameters : mapping
        Values that replace the model's.
    base : Assembly
        The initial state as assembled.
    x : MechanismState
        The initial state with accelerations and multipliers.
    directions : sequence of ParameterDirection
        Parameters.
    lin : ConstrainedSystem
        The constraints at the initial state.
    """
    still = np.zeros(len(x.v))
    if is_fully_driven(base):
        return [consistent_changes(d, x, lin, still, still) for d in directions]
    if is_as_described(model, base):
        return [consistent_changes(d, x, lin, *_described_changes(d, base, x)) for d in directions]

    def found(p: Mapping[str, float]) -> np.ndarray:
        b = assemble(model, t=base.t, parameters=p)
        return np.r_[tangent_step(base.compiled, base.q, b.q), b.v]

    sizes = base.compiled.sizes
    rate = float(base.compiled.work.options.rate) or float(np.abs(base.v / sizes).max(initial=0.0)) or 1.0
    units = np.r_[sizes, rate * sizes]
    return [
        consistent_changes(d, x, lin, *np.split(difference_derivative(model, parameters, d.name, found, units), 2))
        for d in directions
    ]


def initial_state_changes(d: ParameterDirection) -> np.ndarray:
    """Derivatives of the initial controller states by the parameter, (nc,)."""
    initial = initial_controller_states(d.values.structure, d.values.numbers)
    return d.derivative(np.array(initial, complex))


def is_fully_driven(base: Assembly) -> bool:
    """Whether drivers leave no freedom."""
    return leaves_no_freedom(InitialState(base, base, base.y, "", {}))


def is_as_described(model: Model, base: Assembly) -> bool:
    """Whether the start equals the description within rounding, or its open part follows from the described one."""
    drawn = base.compiled.values
    apart = np.abs(tangent_step(base.compiled, drawn.q, base.q) / base.compiled.sizes).max(initial=0.0)
    if apart > DESCRIBED_TOLERANCE or model.initial:
        return False
    return bool(_has_no_added_velocity(base)) or (
        _velocity_targets(base).determined and not any(d.given for d in base.departures)
    )


def _has_no_added_velocity(base: Assembly) -> bool:
    """Whether velocities that are not described are zero."""
    sizes = base.compiled.sizes
    faster = np.abs((base.v - described_velocities(base.compiled.values, base.q)) / sizes).max(initial=0.0)
    return bool(faster <= DESCRIBED_TOLERANCE * np.abs(base.v / sizes).max(initial=0.0))


def _velocity_targets(base: Assembly) -> VelocityEquations:
    c = base.compiled
    c.at(base.t, base.q, base.v)
    return VelocityEquations.at(c, base.q, c.work.rows.nu.copy())


def _described_changes(d: ParameterDirection, base: Assembly, x: MechanismState) -> tuple[np.ndarray, np.ndarray]:
    """Changes of the described positions and velocities, projected onto the constraints as in assembly."""
    c, at = base.compiled, d.e.at
    dq = tangent_rate(c, x.q, d.derivative(d.values.q))
    c.at(x.t, x.q, x.v)
    rows = row_scales(c)
    G = rows[:, None] * c.jacobian()
    which = np.array([r.holonomic for r in c.structure.rows], bool)
    size = np.sqrt(inverse_weights(c))
    left = (rows * d.along(x, dq, np.zeros(len(x.v)))[at["g"]])[which]
    if which.any():
        dq -= size * np.linalg.lstsq(G[which] * size, left, rcond=RANK_TOLERANCE)[0]
    q = x.q.astype(complex)
    retract(d.values.system, q, 1j * COMPLEX_STEP * dq)
    dv = d.derivative(described_velocities(d.values, q)) if _has_no_added_velocity(base) else np.zeros(len(x.v))
    w = _velocity_targets(base)
    if w.G.shape[0]:
        of_held = [d.derivative(velocity_deviation(d.values, g, q, x.v + 1j * COMPLEX_STEP * dv)) for g in w.held]
        of_soft = [
            w.weights[g.name] @ d.derivative(velocity_deviation(d.values, g, q, x.v + 1j * COMPLEX_STEP * dv))
            for g in w.soft
        ]
        missed = np.concatenate([d.along(x, dq, dv)[at["n"]], *of_held])
        dv += w.steps()(-missed, -np.concatenate([np.zeros(0), *of_soft]))
    return dq, dv


def changes_in_motion_coordinates(
    start: InitialState, d: ParameterDirection, values: Values, changes: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Convert initial changes to the coordinates of the motion: (nv,) positions along the velocities, (nv,) velocities.

    Parameters
    ----------
    start : InitialState
    d : ParameterDirection
        The parameter, in absolute coordinates.
    values : Values
        The mechanism's values in the coordinates of the motion, with a complex step of the parameter.
    changes : two arrays (nv,), (nv,)
        The changes in absolute coordinates.
    """
    base, c = start.base, start.assembly.compiled
    if c is base.compiled:
        return changes
    bodies = _body_states(start, d.values, changes)
    q = positions(values, bodies, base.compiled.hints | base.compiled.turned(base.q))
    still = np.zeros((1, c.structure.nv))
    W = RecordedMotion(values, q[None], still, still).W
    v = joint_velocities(values, bodies, BodyKinematicsOverTime(*(part[..., 0] for part in W)))
    return tangent_rate(c, q.real, complex_step_derivative(q)), complex_step_derivative(v)


def _body_states(start: InitialState, values: Values, of: tuple[np.ndarray, np.ndarray]) -> dict[str, BodyState]:
    """State of every body at the start; imaginary parts are changes by the parameter."""
    base = start.base
    q = base.q.astype(complex)
    retract(values.system, q, 1j * COMPLEX_STEP * of[0])
    v = base.v + 1j * COMPLEX_STEP * of[1]
    r = RecordedMotion(values, q[None], v[None], np.zeros((1, len(v))))
    out = {}
    for name, b in values.structure.place.items():
        if b >= 0:
            p, R, w, u, *_ = (np.array(part)[..., 0] for part in r.body(b))
            angle = q[values.system.tree.q[b] + 2] if values.structure.model.planar else 0.0
            out[name] = BodyState(p, R.reshape(3, 3), u, w, angle)
    return out
