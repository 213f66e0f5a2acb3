"""Structure + parameter values -> floats: the System's tables and the drawn state.

Runs again for every change of a parameter; nothing is compiled and no description is validated here. Parameters may be
complex: all tables are then complex, and of a small imaginary part of one parameter their imaginary parts are its
multiple by the exact derivatives (a complex step). What is chosen is chosen by real parts.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..constraints.registry import KINDS
from ..model.body import GROUND, Body
from ..model.coupling import Coupling
from ..model.force import BodyForce, TwoPointForce
from ..model.geometry import vector
from ..model.joint import Joint
from ..model.kept import Kept, bits
from .coordinates import BodyState, free_velocities, positions
from .hinges import tree_frames
from .masses import mass_table
from .numbers import Numbers, numbers
from .points import check_centred
from .specs import FrameSpec, Structure, TermSpec
from .system import System

MOST = 4  # sets of values of one structure that are kept
REGULARISATION = 1e-9


@dataclass
class Values:
    """A compiled mechanism: the System, the drawn state, and the numbers of every element."""

    structure: Structure
    system: System
    q: np.ndarray
    v: np.ndarray
    numbers: Mapping[str, SimpleNamespace]
    bodies: Mapping[str, SimpleNamespace]  # p, R, com: drawn reference frame, centre of mass in it
    length: float  # a typical length of the mechanism [m]
    env: Mapping[str, Any]  # values of the parameters
    poses: Poses  # where frames are when it is drawn
    kept: Kept = field(default_factory=Kept)  # where motions of it start

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
    model, env, numbers, bodies = s.model, given.env, given.of, given.bodies
    dtype: Any = complex if given.complex or any(isinstance(x, complex) for x in holds.values()) else float
    pose = Poses(s, given)
    frame_x = np.array([pose.row(f) for f in s.frames], dtype)
    length = _length(s, frame_x, bodies)
    if s.points:
        single = {s.place[name]: name for name in s.points}
        for f, way in zip(s.frames, frame_x[:, :3], strict=True):
            if f.body in single:
                check_centred(model, single[f.body], f.element, way, length)
    body_x, semidefinite = mass_table(s, bodies, frame_x, length)
    tree_frames(s, pose, numbers, body_x)
    const, curve_at = _constants(s, numbers, env, dtype)
    term_x = _term_x(s, pose, numbers, holds, curve_at, dtype)
    glob = np.array([*model.gravity_vector(env), REGULARISATION, semidefinite, length], dtype)
    t = s.tables
    system = System(
        t["body_i"], body_x, t["frame_i"], frame_x, t["term_i"], term_x, t["seg_i"],
        t["row_i"], t["row_p"], t["col_i"], t["mix_i"], t["force_i"], _force_x(s, pose, numbers, dtype), t["angle_i"],
        t["load_i"], t["kinds"], t["code"], const, glob, t["mass_i"], t["pair_i"], t["block_i"], s.ldl,
    )  # fmt: skip
    x = Values(s, system, np.zeros(s.nq, dtype), np.zeros(s.nv, dtype), numbers, bodies, float(length.real), env, pose)
    drawn = {b.name: BodyState(d.c, d.R, d.v, d.w, d.angle) for b, d in ((b, bodies[b.name]) for b in model.bodies)}
    x.q[:], x.v[:] = positions(x, drawn), free_velocities(x, drawn)
    return x


class Poses:
    """Where the frames of elements are when the mechanism is drawn."""

    def __init__(self, s: Structure, given: Numbers) -> None:
        self.s, self.numbers, self.bodies = s, given.of, given.bodies
        self.model = s.model
        self._given = given

    def row(self, f: FrameSpec) -> np.ndarray:
        """Position (3) from the body's centre of mass and rotation (9), in body axes."""
        key = (f.element.name, f.role, f.coordinate) if f.element is not None else ()
        found = self._given.local.get(key)
        if found is None:
            p, R, name = self.world(f)
            b = self.bodies[name]
            back = b.R.T
            found = self._given.local[key] = np.concatenate((back @ (p - b.c), (back @ R).ravel()))
        return found

    def local(self, f: FrameSpec) -> tuple[np.ndarray, np.ndarray]:
        """Position from the body's centre of mass and rotation, in body axes."""
        row = self.row(f)
        return row[:3], row[3:].reshape(3, 3)

    def world(self, f: FrameSpec) -> tuple[np.ndarray, np.ndarray, str]:
        """Position, rotation and carrier of a frame in the drawn configuration."""
        if f.element is None:
            return np.zeros(3), np.eye(3), GROUND
        key = f.element.name, f.role, f.coordinate
        found = self._given.world.get(key)
        if found is None:
            found = self._given.world[key] = self._drawn(f)
        return found

    def _drawn(self, f: FrameSpec) -> tuple[np.ndarray, np.ndarray, str]:
        e = f.element
        n = self.numbers[e.name]
        end = e.ends()[f.role]
        name = self.model.carrier(end, e)
        if isinstance(e, BodyForce):
            p, R = self.named(end)
            if isinstance(self.model[end], Body):
                at = getattr(n, "at", None)
                p = self.bodies[name].c if at is None else vector(at, self.model.planar, e.title)
            return p, R, name
        p, R = self._placed(e, n)[f.role] if hasattr(e, "placed") and n.at is not None else self.named(end)
        if f.coordinate:
            R = R @ np.array(getattr(e.coordinates[f.coordinate], f"turn_{f.role}"))
        return p, R, name

    def _placed(self, e: Any, n: SimpleNamespace) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        found = self._given.placed.get(e.name)
        if found is None:
            found = self._given.placed[e.name] = e.placed(n, self.model.planar)
        return found

    def named(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Drawn pose of a body's reference frame or of a named frame."""
        if name in self.bodies:
            return self.bodies[name].p, self.bodies[name].R
        e = self.model[name]
        n = self.numbers[name]
        b = self.bodies[e.body]
        return b.p + b.R @ vector(n.position, self.model.planar, e.title), b.R @ e.rotation(n)

    def separation(self, e: Any) -> float:
        """Drawn distance from the first of an element's frames to the last, by way of all between."""
        points = [self.world(FrameSpec(0, e, role))[0] for role in e.ends()]
        return sum(np.sqrt(((b - a) ** 2).sum()) for a, b in itertools.pairwise(points))

    def ends(self, e: Any) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Drawn frames F and M of a joint."""
        F, M = (self.world(FrameSpec(0, e, role))[:2] for role in "FM")
        return F, M

    def axis(self, joint: str) -> np.ndarray:
        """Axis of a joint's angle in the world as drawn."""
        e = self.model[joint]
        R = self.ends(e)[0][1]
        turn = e.coordinates["angle"].turn_F if "angle" in e.coordinates else ()
        return (R @ np.array(turn) if len(turn) else R)[:, 2]

    def drawn(self, t: TermSpec) -> float:
        """What a term's formula gives in the drawn configuration."""
        poses = (self.world(self.s.frames[k]) for k in (t.F, t.M))
        F, M = ((tuple(p), tuple(R.ravel()), *((0.0,) * 3,) * 4) for p, R, _ in poses)
        par = (1.0, *t.formula.par[1:6], 0.0, 0.0) if KINDS[t.formula.kind].turns else (*t.formula.par[:6], 0.0, 0.0)
        return KINDS[t.formula.kind].row(par, F, M, self.turned(t.owner), None)[0]

    def turned(self, owner: Any) -> float:
        """Angle of a body or frame in the plane as drawn, whole turns counted; 0 for joints, which begin there."""
        if isinstance(owner, Joint) or not self.model.planar:
            return 0.0
        own = self.numbers[owner.name].angle
        return own if isinstance(owner, Body) or owner.body == GROUND else own + self.numbers[owner.body].angle


def _length(s: Structure, frame_x: np.ndarray, bodies: Mapping[str, SimpleNamespace]) -> Any:
    """A typical length: the largest way from a centre of mass to a frame, or from one body to the mean of all."""
    centres = np.array([b.c for k, b in bodies.items() if k != GROUND])
    ways = np.concatenate([frame_x[s.tables["frame_i"] >= 0, :3], centres - centres.mean(axis=0)])
    longest = ways[np.argmax((ways.real**2).sum(axis=1))]
    length = np.sqrt((longest**2).sum())
    return length if length.real > 0.0 else 1.0


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
    s: Structure, pose: Poses, numbers: Mapping, holds: Mapping[str, Any], curve_at: Mapping[str, int], dtype: Any
) -> np.ndarray:
    """Parameters of the terms: axes from the declaration, constants from the numbers."""
    x = np.zeros((len(s.terms), 8), dtype)
    factors = {c.name: np.array(c.factors(numbers[c.name], s.model, pose.axis)) for c in s.model.couplings}
    factors = {name: f / f[0] for name, f in factors.items()}
    for k, t in enumerate(s.terms):
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


def _force_x(s: Structure, pose: Poses, numbers: Mapping, dtype: Any) -> np.ndarray:
    x = np.zeros((len(s.forces), 16), dtype)
    for k, e in enumerate(s.forces):
        separation = pose.separation(e) if isinstance(e, TwoPointForce) or len(e.ends()) > 1 else 0.0
        par = e.parameters(numbers[e.name], separation)
        x[k, : len(par)] = par
    return x
