"""Steady motions (relative equilibria): constant as seen from an evenly turning frame.

Along such a motion the coefficients of the linear equations x' = A(t) x only turn: A(t) = T A(0) T^-1 with
T = exp(t H). In co-moving coordinates y = T^-1 x they are constant, y' = (A(0) - H) y. In other coordinates the
eigenvalues of A(t) have no meaning (a conical pendulum seen from the ground). H turns positions with the frame.
Rotations have components along the axes of the bodies; H turns them by the spin of each body relative to the frame.
A wheel that spins about its axis of symmetry is therefore steady. Where a motion is steady in several frames, the
frame that stands still or turns slowest is taken.
Let B(t) be the changes of the bodies' positions and rotations. Seen from the frame they are T(t)^-1 B(t) with
T = exp(t H_B), in any coordinates. Coordinates x with B = J x turn by H, where J H = H_B J - dJ/dt. The choice of the
frame therefore does not depend on the coordinates, nor do the eigenvalues in that frame.
"""

from __future__ import annotations

import numpy as np

from ..engine.kinematics import coordinate_rates, normalise_quaternions, quaternion_at
from ..errors import AnalysisError
from ..laws.bytecode import INPUT
from ..numerics.rank import fundamental_subspaces
from ..results.motion_record import RecordedMotion
from ..results.wording import tuple_text
from ..tables.structure_definition import velocity_names
from ..tables.table_definitions import System
from .equation_derivatives import (
    COMPLEX_STEP,
    EquationDerivatives,
    MechanismState,
    complex_step_derivative,
    force_magnitudes,
    residual_rounding,
    state_sizes,
)
from .linearized_equations import (
    FreeCoordinates,
    TurningFrame,
    normalised_rows,
    reduced_equations,
    static_equations,
)

TURNING_TOLERANCE = 1e-9  # singular values below this part of the largest leave the frame's rotation undetermined
IN_PLANE = (0, 1, 5)  # indices of x, y and the angle about z among the six coordinates of a body
MATRIX_ROUNDING = 1e-13  # entries of H below this part of the largest are rounding


def kinematic_matrix(x: MechanismState) -> np.ndarray:
    """N of `TurningFrame`, (nv, nv): the changes of rotations have components along turning body axes."""
    S = x.c.values.system
    N = np.zeros((len(x.v),) * 2)
    for b in range(len(S.tree.parent)):
        _, w0 = quaternion_at(S, b)
        if w0 >= 0:
            at = slice(w0, w0 + 3)
            N[at, at] = -_cross_product_matrix(x.v[at])
    return N


def candidate_frames(x: MechanismState) -> list[TurningFrame]:
    """Frames in which the motion may be steady, the most likely first.

    In such a frame all velocities and angular velocities turn with the frame: a = W x v, alpha = W x w. The part of W
    that this leaves undetermined is chosen so that the frame stands still, or so that it turns with one of the bodies.
    """
    c = x.c
    c.at(x.t, x.q, x.v)
    r = RecordedMotion(c.values, x.q[None], x.v[None], x.vdot[None])
    kept = [np.array([r.body(b)[k] for b in c.structure.place.values() if b >= 0])[..., 0] for k in (2, 3, 4, 5)]
    w, v, alpha, a = kept
    length = c.values.length
    A = np.vstack([-_cross_product_matrix(u) for u in [*(v / length), *w]])
    right = np.r_[(a / length).ravel(), alpha.ravel()]
    p = fundamental_subspaces(A, TURNING_TOLERANCE)
    least, open_ = p.row_space @ ((p.span.T @ right) / p.values), p.null.T
    turns, fast = [least], max(np.abs(w).max(), np.abs(v).max() / length)
    for spin in w:
        other = least + open_.T @ (open_ @ (spin - least))
        if min(np.abs(other - seen).max() for seen in turns) > TURNING_TOLERANCE * fast:
            turns.append(other)
    turns = [np.where(np.abs(t) > TURNING_TOLERANCE * fast, t, 0.0) for t in turns]  # smaller components are rounding
    N = kinematic_matrix(x)
    return [TurningFrame(turning, turning_matrix(x, turning), N) for turning in turns]


def frame_description(x: MechanismState, frame: TurningFrame, frozen: bool) -> str:
    """Text that describes the frame of linear equations about a motion; empty at rest."""
    if not np.abs(x.v).max(initial=0.0) > 0.0:
        return ""
    if frozen:
        return "the coordinates of this very instant"
    if not frame.turning.any():
        return "the ground"
    return f"a frame that turns with {tuple_text(frame.turning)} rad/s"


def turning_matrix(x: MechanismState, turning: np.ndarray) -> np.ndarray:
    """H of `TurningFrame` (nv, nv), for a frame with the angular velocity ``turning`` [rad/s]."""
    s, S = x.c.structure, x.c.values.system
    if s.tree:
        return _joint_turning_matrix(x, turning)
    x.c.at(x.t, x.q, x.v)
    H = np.zeros((len(x.v),) * 2)
    for b in range(len(S.tree.parent)):
        v0, n = int(S.tree.v[b]), int(S.tree.nv[b])
        own = _body_turning_matrix(
            np.array(x.c.work.bodies.rotation[b]).reshape(3, 3), np.array(x.c.work.bodies.angular_velocity[b]), turning
        )
        kept = (IN_PLANE if s.model.planar else range(6))[:n]  # a point mass has no rotation
        H[v0 : v0 + n, v0 : v0 + n] = own[np.ix_(kept, kept)]
    return H


def _body_turning_matrix(R: np.ndarray, w: np.ndarray, turning: np.ndarray) -> np.ndarray:
    """H_B of a body: position turns with the frame, rotation (body axes) with the spin relative to the frame."""
    H = np.zeros((6, 6))
    H[:3, :3] = _cross_product_matrix(turning)
    H[3:, 3:] = -_cross_product_matrix(R.T @ (w - turning))
    return H


def _joint_turning_matrix(x: MechanismState, turning: np.ndarray) -> np.ndarray:
    """H in joint coordinates, with J and dJ/dt from a complex step along the motion."""
    c, nv = x.c, len(x.v)
    S, one = c.values.system, np.eye(nv)
    ahead = np.zeros_like(x.q)
    c.at(x.t, x.q, x.v)
    coordinate_rates(S, x.q, x.v, ahead)
    r = RecordedMotion(c.values, np.tile(x.q + 1j * COMPLEX_STEP * ahead, (nv, 1)), one, 0.0 * one)
    J, rate, turned = [], [], []
    for b in c.structure.place.values():
        if b < 0:
            continue
        R, w, v = (np.array(part) for part in r.body(b)[1:4])
        own = np.vstack([v, np.einsum("jin,jn->in", R.reshape(3, 3, nv), w)])
        H = _body_turning_matrix(R[:, 0].real.reshape(3, 3), w.real @ x.v, turning)
        size = np.r_[np.full(3, c.values.length), np.ones(3)][:, None]
        J.append(own.real / size * c.sizes)
        rate.append(complex_step_derivative(own) / size * c.sizes)
        turned.append(H @ own.real / size * c.sizes)
    H = np.linalg.lstsq(np.vstack(J), np.vstack(turned) - np.vstack(rate), rcond=None)[0]
    H = np.where(np.abs(H) > MATRIX_ROUNDING * np.abs(H).max(initial=0.0), H, 0.0)
    return c.sizes[:, None] * H / c.sizes


def _cross_product_matrix(w: np.ndarray) -> np.ndarray:
    """Matrix of the cross product w x ."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


# Motion between the two times compared: angle [rad] or distance relative to the mechanism's length.
COMPARISON_ANGLE = 0.1
COMPARISON_STEPS = 16
BALANCE_TOLERANCE = 1e-6  # largest residual of an equilibrium, relative to the forces
# Position error allowed at an equilibrium [rad, or relative to the mechanism's length].
POSITION_TOLERANCE = 1e-9
COEFFICIENT_TOLERANCE = 1e-5  # relative difference below which linear equations are equal
# A state is at rest below this speed, relative to the speed that gravity or the largest acceleration gives.
REST_SPEED = 1e-9


def is_steady(x: MechanismState, e: EquationDerivatives, f: FreeCoordinates, frame: TurningFrame) -> bool:
    """Whether accelerations and linear equations are unchanged a short time later, as seen from the frame."""
    from scipy.linalg import expm

    sizes = x.c.sizes
    size = np.abs(x.v / sizes).max() ** 2 + np.abs(x.vdot / sizes).max()
    if not np.abs((x.vdot - frame.H @ x.v) / sizes).max() <= COEFFICIENT_TOLERANCE * size:
        return False  # the velocities do not just turn with the frame
    changes = continuous_rates(e) / state_sizes(e).change if e.nz else np.zeros(0)
    if not np.abs(changes).max(initial=0.0) <= COEFFICIENT_TOLERANCE * np.sqrt(size):
        return False
    tau, later = _advanced_state(x, frame)
    T = expm(tau * frame.H)
    if not np.abs((later.vdot - T @ x.vdot) / sizes).max() <= COEFFICIENT_TOLERANCE * size:
        return False
    then = EquationDerivatives(later)
    g = f.turned(T, then)
    motions = g.Zv / sizes[:, None] * sizes[f.chosen_v]
    missed = normalised_rows(g.rows, sizes) @ motions
    if np.abs(missed).max(initial=0.0) > COEFFICIENT_TOLERANCE * np.abs(motions).max(initial=0.0):
        return False
    now = reduced_equations(e, f, frame).A
    other = reduced_equations(
        then, g, TurningFrame(frame.turning, turning_matrix(later, frame.turning), kinematic_matrix(later))
    ).A
    unit = np.r_[sizes[f.chosen], np.sqrt(size) * sizes[f.chosen_v], state_sizes(e).change if e.nz else []]
    change, most = (np.abs(A * unit / unit[:, None]).max(initial=0.0) for A in (other - now, now))
    return bool(change <= COEFFICIENT_TOLERANCE * most)


def is_still(x: MechanismState) -> bool:
    """Whether all speeds are negligible compared with the mechanism's characteristic rate or its accelerations."""
    pace = float(x.c.work.options.rate)
    given = np.sqrt(pace**2 + np.abs(x.vdot / x.c.sizes).max(initial=0.0))
    return not (np.abs(x.v) / x.c.sizes).max(initial=0.0) > REST_SPEED * given


def continuous_rates(e: EquationDerivatives) -> np.ndarray:
    """Rates of the controller states between the instants at which they are sampled, (nz,)."""
    return np.where(e.sampled, 0.0, e.state_rates)


def steady_frame(x: MechanismState, e: EquationDerivatives, f: FreeCoordinates) -> TurningFrame:
    """Frame in which the state is steady, the world at an equilibrium.

    Raises
    ------
    AnalysisError
        If the state is neither an equilibrium nor a steady motion. The message names an unbalanced acceleration.
    """
    none = np.zeros((len(x.v),) * 2)
    if not f.Zv.shape[1] and not e.nz:  # drivers prescribe the whole motion
        return TurningFrame(np.zeros(3), none, none)
    if is_still(x):
        refuse_unbalanced(x, e)
        at_rest = TurningFrame(np.zeros(3), none, none)
        if has_time_laws(x.c.values.system):
            _refuse_time_dependence(x, e, f, at_rest)
        return at_rest
    for frame in candidate_frames(x):
        if is_steady(x, e, f, frame):
            return frame
    raise AnalysisError(
        f"the motion at t = {x.t:.6g} s is not steady: it is not constant in any frame that turns uniformly. "
        "Linearise about an equilibrium (about=m.equilibrium()) or a steady motion, or take the equations of this "
        "instant with frozen=True"
    )


def refuse_unbalanced(x: MechanismState, e: EquationDerivatives) -> None:
    """Refuse a state at rest that is not an equilibrium.

    Raises
    ------
    AnalysisError
        With the name of the controller state that changes most, or of the velocity with the largest acceleration.
    """
    left = _remaining_rates(x, e)
    if not left.any():
        return
    nv = len(x.v)
    if left[nv:].any():
        k = int(np.argmax(left[nv:]))
        raise AnalysisError(
            f"the controllers are not in equilibrium where the mechanism is: {rate_description(e, k)}. Find an "
            f"equilibrium first and linearise about it: about=m.equilibrium(); or ask about the end of a motion that "
            f"has settled"
        )
    names, d = velocity_names(x.c.structure), int(np.argmax(left))
    raise AnalysisError(
        f"the mechanism is not in equilibrium where it is: {names[d].name} is accelerated with "
        f"{x.vdot[d]:.3g} {names[d].unit}/s^2. Find an equilibrium first and linearise about it: "
        f"about=m.equilibrium()"
    )


def rate_description(e: EquationDerivatives, k: int) -> str:
    """Text that describes how a controller state changes."""
    x, rate = e.state.c.structure.controls[k], e.state_rates[k]
    if x.controller.sampled:
        return f"the next sample changes {x.name!r} by {rate:.3g}"
    return f"{x.name!r} changes by {rate:.3g} in a second"


def _remaining_rates(x: MechanismState, e: EquationDerivatives) -> np.ndarray:
    """Unbalanced accelerations, and rates of controller states, (nv + nz,) in natural units, zero where balanced."""
    rest, r, s = static_equations(e), e.at["r"], e.at["s"]
    change = state_sizes(e).change if e.nz else np.zeros(0)
    left = np.abs(np.r_[rest.block("r"), continuous_rates(rest)])
    may = np.r_[BALANCE_TOLERANCE * force_magnitudes(rest), np.zeros(e.nz)]
    may += POSITION_TOLERANCE * np.r_[abs(e.by_position[r]) @ x.c.sizes, abs(e.by_position[s]) @ x.c.sizes]
    may += POSITION_TOLERANCE * np.r_[abs(e.by_state[r]) @ change, abs(e.state_jacobian) @ change]
    if (left <= may).all() or (left <= may + residual_rounding(rest)).all():
        return np.zeros(len(left))
    return np.where(left > may, np.r_[np.abs(x.vdot) * x.c.sizes, left[len(x.v) :] / change], 0.0)


def has_time_laws(S: System) -> bool:
    """Whether a law of a force, a controller or gravity depends on time."""
    for law in [*S.forces.laws.ravel().tolist(), *S.control_laws.tolist(), *S.gravity_laws[:3].tolist()]:
        if law >= 0:
            program = S.code[law + 2 : law + 2 + 2 * S.code[law]].reshape(-1, 2)
            if (program == (INPUT, 0)).all(axis=1).any():
                return True
    return False


def _refuse_time_dependence(x: MechanismState, e: EquationDerivatives, f: FreeCoordinates, frame: TurningFrame) -> None:
    """Refuse linear equations that change with time although the mechanism rests."""
    now = reduced_equations(e, f, frame)
    rates = now.A * now.uncertainty.unit / now.uncertainty.unit[:, None]  # in natural units of the states [1/s]
    fastest = float(np.abs(rates).max(initial=0.0)) or float(x.c.work.options.rate) or 1.0
    z = x.c.z.copy()
    then = reduced_equations(
        EquationDerivatives(MechanismState.moving(x.c, x.t + COMPARISON_ANGLE / fastest, x.q, x.v)), f, frame
    )
    x.c.at(x.t, x.q, x.v)
    x.c.z = z
    changed = (then.A - now.A) * now.uncertainty.unit / now.uncertainty.unit[:, None]
    if np.abs(changed).max(initial=0.0) > COEFFICIENT_TOLERANCE * fastest:
        raise time_dependence_error()


def time_dependence_error() -> AnalysisError:
    """The error for linear equations that change with time at rest."""
    return AnalysisError(
        "the mechanism is at rest, but its force laws depend on time, and so do its linear equations; frozen=True "
        "gives those of this instant"
    )


def advanced_equations(
    x: MechanismState, f: FreeCoordinates, frame: TurningFrame
) -> tuple[EquationDerivatives, FreeCoordinates, TurningFrame]:
    """Equations, free coordinates and frame a short time later; the bases are turned with the frame."""
    from scipy.linalg import expm

    tau, later = _advanced_state(x, frame)
    then = EquationDerivatives(later)
    own = TurningFrame(frame.turning, turning_matrix(later, frame.turning), kinematic_matrix(later))
    return then, f.turned(expm(tau * frame.H), then), own


def _advanced_state(x: MechanismState, frame: TurningFrame) -> tuple[float, MechanismState]:
    """(time, state) a short time later if velocities turn with the frame; kinematics only, so never stiff."""
    from scipy.linalg import expm

    c, z, q = x.c, x.c.z.copy(), x.q.copy()
    c.at(x.t, x.q, x.v)
    S, W = c.values.system, c.work
    h = (
        COMPARISON_ANGLE
        / max(np.abs(W.bodies.angular_velocity).max(), np.abs(W.bodies.velocity).max() / c.values.length)
        / COMPARISON_STEPS
    )
    half, v = expm(0.5 * h * frame.H), x.v

    def rate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        out = np.zeros_like(q)
        coordinate_rates(S, q, v, out)
        return out

    for _ in range(COMPARISON_STEPS):
        middle = half @ v
        end = half @ middle
        k1 = rate(q, v)
        k2 = rate(q + 0.5 * h * k1, middle)
        k3 = rate(q + 0.5 * h * k2, middle)
        k4 = rate(q + h * k3, end)
        q, v = q + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), end
    normalise_quaternions(S, q)
    later = MechanismState.moving(c, x.t + COMPARISON_STEPS * h, q, v)
    c.z = z
    return COMPARISON_STEPS * h, later
