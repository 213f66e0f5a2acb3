"""Structure + parameter values -> floats: the System's tables and the drawn state.

Runs again for every change of a parameter; nothing is compiled and no description is validated here. Parameters may be
complex: all tables are then complex, and of a small imaginary part of one parameter their imaginary parts are its
multiple by the exact derivatives (a complex step). What is chosen is chosen by real parts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..constraints.registry import KINDS
from ..math.scalar import absolute, maximum
from ..model.body import GROUND
from ..model.coupling import Coupling
from ..model.force import TwoPointForce
from ..model.joint import Joint
from ..model.kept import Kept, bits
from .afresh import Afresh
from .coordinates import BodyState, free_velocities, positions
from .inertia import inverse_inertia
from .numbers import Numbers, numbers
from .poses import Poses
from .specs import FrameSpec, Structure, TermSpec
from .system import (
    BODY_P,
    BODY_R,
    BODY_TURNS,
    BODY_WIDTH,
    EXCESS,
    INERTIA,
    INVERSE,
    MASS,
    OFFSET,
    PER_COMPACT,
    PER_MASS,
    REVOLUTE,
    TREE,
    TREE_P,
    TREE_R,
    TREE_TURNS,
    System,
)

MOST = 4  # sets of values of one structure that are kept
REGULARISATION = 1e-9
TO_AXIS = {"x": np.roll(np.eye(3), 2, axis=1), "y": np.roll(np.eye(3), 1, axis=1), "z": np.eye(3)}  # z goes there
BACK = np.diag([1.0, -1.0, -1.0])  # turns an axis round


@dataclass
class Values:
    """A compiled mechanism: the System, the drawn state, and the numbers of every element."""

    structure: Structure
    system: System
    q: np.ndarray
    v: np.ndarray
    given: Numbers
    length: float  # a typical length of the mechanism [m]
    poses: Poses  # where frames are when it is drawn
    kept: Kept = field(default_factory=Kept)  # where motions of it start

    @property
    def numbers(self) -> Mapping[str, SimpleNamespace]:
        """Element -> its fields in SI units."""
        return self.given.of

    @property
    def bodies(self) -> Mapping[str, SimpleNamespace]:
        """Body -> p, R, com: drawn reference frame, centre of mass in it; c: where that is drawn."""
        return self.given.bodies

    @property
    def env(self) -> Mapping[str, Any]:
        """Values of the parameters."""
        return self.given.env

    @property
    def told(self) -> dict[str, float]:
        """Values of the parameters that it was made with."""
        names = list(self.structure.model.parameters)
        return dict(zip(names, self.system.const[: len(names)].real.tolist(), strict=True))


def values(
    s: Structure, parameters: Mapping[str, complex] | None = None, holds: Mapping[str, complex] | None = None
) -> Values:
    """Numbers of a mechanism: filled in once for each set of values, shared by all who ask, not to be changed.

    Parameters
    ----------
    s : Structure
    parameters : mapping, optional
        Values in SI units in place of the model's own. If one is complex, all tables and the state are.
    holds : mapping, optional
        Values of the coordinates that are held (see ``structure``).
    """
    n = numbers(s.model, parameters)
    if n.complex or any(isinstance(x, complex) for x in (holds or {}).values()):
        return _filled(s, n, holds or {})
    return s.kept.get("values", (n.key, bits(holds or {})), MOST, lambda: _filled(s, n, holds or {}))


def _filled(s: Structure, given: Numbers, holds: Mapping[str, Any]) -> Values:
    """All tables; where some were filled in before, only the rows that depend on what is different now."""
    if holds:
        return _refilled(s, given, holds, Afresh())
    first = s.kept.known("filled first")
    x = _refilled(s, given, holds, Afresh.since(first, given, s.model))
    if first is None and not given.complex:
        s.kept.get("filled first", None, 1, lambda: x)
    return x


def _refilled(s: Structure, given: Numbers, holds: Mapping[str, Any], new: Afresh) -> Values:
    model, env, numbers, bodies = s.model, given.env, given.of, given.bodies
    dtype: Any = complex if given.complex or any(isinstance(x, complex) for x in holds.values()) else float
    pose = Poses(s, given)
    frame_x = _frame_x(s, pose, new.table("frame_x", (len(s.frames), 12), dtype), new)
    length = _length(s, frame_x, bodies)
    body_x = _body_x(s, bodies, frame_x, length, new)
    _tree_frames(s, pose, numbers, body_x, new)
    const, curve_at = _constants(s, numbers, env, dtype)
    term_x = _term_x(s, pose, holds, curve_at, new.table("term_x", (len(s.terms), 8), dtype), new)
    force_x = _force_x(s, pose, new.table("force_x", (len(s.forces), 16), dtype), new)
    semidefinite = 1.0 if body_x[:, EXCESS : EXCESS + 9].any() else 0.0
    glob = np.array([*model.gravity_vector(env), REGULARISATION, semidefinite, length], dtype)
    t = s.tables
    system = System(
        t["body_i"], body_x, t["frame_i"], frame_x, t["term_i"], term_x, t["seg_i"],
        t["row_i"], t["row_p"], t["col_i"], t["mix_i"], t["force_i"], force_x, t["angle_i"], t["load_i"],
         t["kinds"], t["code"], const, glob, t["mass_i"], t["pair_i"], t["block_i"], s.ldl,
    )  # fmt: skip
    x = Values(s, system, new.state("q", s.nq, dtype), new.state("v", s.nv, dtype), given, float(length.real), pose)
    drawn = {b.name: BodyState(d.c, d.R, d.v, d.w, d.angle) for b, d in ((b, bodies[b.name]) for b in model.bodies)}
    x.q[:], x.v[:] = positions(x, drawn, new=new), free_velocities(x, drawn, new=new)
    return x


def _frame_x(s: Structure, pose: Poses, x: np.ndarray, new: Afresh) -> np.ndarray:
    for k, f in enumerate(s.frames):
        if new.asks(f.element):
            p, R = pose.local(f)
            x[k, :3], x[k, 3:] = p, R.ravel()
    return x


def _length(s: Structure, frame_x: np.ndarray, bodies: Mapping[str, SimpleNamespace]) -> Any:
    """A typical length: the largest way from a centre of mass to a frame, or from one body to the mean of all."""
    centres = np.array([b.c for k, b in bodies.items() if k != GROUND])
    ways = np.concatenate([frame_x[s.tables["frame_i"] >= 0, :3], centres - centres.mean(axis=0)])
    longest = ways[np.argmax((ways.real**2).sum(axis=1))]
    length = np.sqrt((longest**2).sum())
    return length if length.real > 0.0 else 1.0


def _reach(ways: np.ndarray) -> Any:
    """The largest component of some ways, taken positive."""
    flat = ways.ravel()
    return absolute(flat[np.argmax(np.abs(flat.real))]) if len(flat) else 0.0


def _body_x(s: Structure, bodies: Mapping, frame_x: np.ndarray, length: Any, new: Afresh) -> np.ndarray:
    """Mass, inertia, its inverse; where a principal inertia is none, a stand-in that the solve takes out again."""
    body_x = new.table("body_x", (len(s.tables["body_i"]), BODY_WIDTH), frame_x.dtype)
    moved = {f.body for f in s.frames if new.asks(f.element)}
    rescaled = new.base is None or new.base.system.glob[-1] != length
    for name, b in s.place.items():
        if b < 0 or not (rescaled or b in moved or new.asks(s.model[name])):
            continue
        reach = _reach(frame_x[s.tables["frame_i"] == b, :3])
        d = bodies[name]
        J = np.diag([0.0, 0.0, d.inertia[2, 2]]) if s.model.planar else d.inertia
        size = maximum(d.inertia[2, 2] if s.model.planar else np.trace(d.inertia) / 2, d.mass * reach**2)
        size = size if size.real > 0.0 else d.mass * length**2
        inverse, more = inverse_inertia(J, size, s.model.planar)
        body_x[b, MASS] = d.mass
        body_x[b, PER_MASS], body_x[b, PER_COMPACT] = 1.0 / d.mass, 1.0 / size
        for at, A in ((INERTIA, J), (INVERSE, inverse), (EXCESS, more)):
            body_x[b, at : at + 9] = A.ravel()
    return body_x


def _tree_frames(s: Structure, pose: Poses, numbers: Mapping, body_x: np.ndarray, new: Afresh) -> None:
    """Frames of the tree joints, each with z along its own axis: on what comes before, and seen from what comes after.

    A chain leads from F to M; where the body beyond carries F it is gone back, every step about the axis turned round.
    """
    for t in s.tree_joints.values():
        joint = t.joint
        if not new.asks(joint):
            continue
        rest = np.array(joint.rest or np.eye(3))
        (pF, RF), (pM, RM) = (pose.local(FrameSpec(0, joint, role)) for role in "FM")
        start, end = (pF, RF), (-rest @ RM.T @ pM, rest @ RM.T)
        if t.reversed:
            start, end = (pM, RM @ rest.T), (-RF.T @ pF, RF.T)
        turns = [TO_AXIS[p.axis] @ (BACK if t.reversed and p.kind != "S" else np.eye(3)) for p in t.primitives] or [
            np.eye(3)
        ]
        for k, (link, turn) in enumerate(zip(t.links, turns, strict=True)):
            p, R = start if k == 0 else (np.zeros(3), np.eye(3))
            body_x[link, TREE_P : TREE_P + 3], body_x[link, TREE_R : TREE_R + 9] = p, (R @ turn).ravel()
            p, R = end if k == len(turns) - 1 else (np.zeros(3), np.eye(3))
            body_x[link, BODY_P : BODY_P + 3], body_x[link, BODY_R : BODY_R + 9] = turn.T @ p, (turn.T @ R).ravel()
        for link in t.links:
            _leave_out(body_x[link], s.tables["body_i"][link, TREE])
        for link, step in zip(t.links, t.primitives, strict=False):
            if step.coordinate in joint.coordinates:
                body_x[link, OFFSET] = joint.offset(numbers[joint.name], step.coordinate)


def _leave_out(x: np.ndarray, kind: int) -> None:
    """Note in a body's row which of its joint's constant rotations are none: they need not be multiplied.

    One about the axis of a hinge may as well come after the hinge's own, and becomes one with what stands there.
    """
    tree, body = slice(TREE_R, TREE_R + 9), slice(BODY_R, BODY_R + 9)
    T = x[tree].reshape(3, 3).copy()
    if kind == REVOLUTE and T[2, 2] == 1.0 and not T[2, :2].any() and not T[:2, 2].any():
        x[BODY_P : BODY_P + 3] = T @ x[BODY_P : BODY_P + 3]
        x[body], x[tree] = (T @ x[body].reshape(3, 3)).ravel(), np.eye(3).ravel()
    for rotation, turns in ((tree, TREE_TURNS), (body, BODY_TURNS)):
        if not x[rotation].imag.any() and np.abs(x[rotation] - np.eye(3).ravel()).max() < 1e-15:
            x[rotation] = np.eye(3).ravel()
        x[turns] = (x[rotation] != np.eye(3).ravel()).any()


def _constants(s: Structure, numbers: Mapping, env: Mapping[str, Any], dtype: Any) -> tuple[np.ndarray, dict[str, int]]:
    """Parameters, literals and tables of the laws, splines of joints; where those of each joint begin."""
    const: list[Any] = list(s.const or [0.0])
    const[: len(s.model.parameters)] = [env[k] for k in s.model.parameters]
    curve_at = {}
    for e in s.model.joints:
        if curves := e.curves(numbers[e.name]):
            curve_at[e.name] = len(const)
            for data in curves:
                const += data
    return np.array(const, dtype), curve_at


def _term_x(
    s: Structure,
    pose: Poses,
    holds: Mapping[str, Any],
    curve_at: Mapping[str, int],
    x: np.ndarray,
    new: Afresh,
) -> np.ndarray:
    """Parameters of the terms: axes from the declaration, constants from the numbers."""
    numbers = pose.numbers
    factors = {c.name: np.array(c.factors(numbers[c.name], s.model, pose.axis)) for c in s.model.couplings}
    factors = {name: f / f[0] for name, f in factors.items()}
    for k, t in enumerate(s.terms):
        if not new.asks(t.element, t.owner):
            continue
        x[k] = t.formula.par
        x[k, 7] = t.sign * t.formula.par[7]
        e = t.element
        n = numbers[e.name]
        if t.hint >= 0 and KINDS[t.formula.kind].turns:
            x[k, 0] = 1.0
        if isinstance(e, Joint) and t.owner is None:
            x[k, :7] = e.constants(n, t.formula, *pose.ends(e))
            if KINDS[t.formula.kind].place:
                at = curve_at[e.name]
                x[k, 1:3] = at, at + len(e.curves(n)[0])
        elif isinstance(e, Joint):
            x[k, 7] *= e.weight(n, t.what, *pose.ends(e))
        elif isinstance(e, Coupling):
            x[k, 7] *= factors[e.name][t.index]
            x[k, 6] = _coupled(e, n, t, pose)
        elif t.owner is not None:
            x[k, 6] = t.sign * (holds.get(e.name, 0.0) - _offset(t, numbers))
    return x


def _offset(t: TermSpec, numbers: Mapping) -> float:
    """Value of a term's coordinate as drawn."""
    return t.owner.offset(numbers[t.owner.name], t.what) if isinstance(t.owner, Joint) else 0.0


def _coupled(e: Coupling, n: SimpleNamespace, t: TermSpec, pose: Poses) -> float:
    """What a coupled coordinate is compared with: what it is as drawn, unless the sum is given."""
    total = e.total(n)
    if total is None:
        return pose.drawn(t)
    share = total / e.first_weight(n) if t.index == 0 else 0.0
    return t.sign * (share - _offset(t, pose.numbers))


def _force_x(s: Structure, pose: Poses, x: np.ndarray, new: Afresh) -> np.ndarray:
    for k, e in enumerate(s.forces):
        if not new.asks(e):
            continue
        separation = pose.separation(e) if isinstance(e, TwoPointForce) or len(e.ends()) > 1 else 0.0
        par = e.parameters(pose.numbers[e.name], separation)
        x[k], x[k, : len(par)] = 0.0, par
    return x
