"""Mechanisms as numbers, for every engine alike: links that hang in a tree, joints with one freedom, cut loops.

All is drawn in the world, where every link's axes lie along the world's; joint coordinates are zero there. A joint with
more freedoms is a chain of hinges and slides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import flyball as fb
from mechanisms import GROUND, Planar, following, point

Array = np.ndarray


@dataclass(frozen=True)
class Axis:
    """A hinge about, or a slide along, a line; with a spring that carries nothing where the coordinate is ``rest``."""

    kind: str  # "hinge" or "slide"
    point: Array
    direction: Array
    stiffness: float = 0.0
    rest: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True)
class Link:
    """A body: its inertia about its centre of mass, and how it hangs on an earlier link or on ground."""

    name: str
    mass: float
    inertia: Array  # (3, 3)
    centre: Array
    parent: int
    axes: tuple[Axis, ...]


@dataclass(frozen=True)
class Cut:
    """A joint that closes a loop: a ball, or with ``axis`` a hinge."""

    i: int
    j: int
    point: Array
    axis: Array | None = None

    @property
    def points(self) -> list[Array]:
        """The points that both links share: one, or two 0.5 m to either side on the axis."""
        if self.axis is None:
            return [self.point]
        return [self.point - 0.5 * self.axis, self.point + 0.5 * self.axis]


@dataclass(frozen=True)
class Spring:
    """Spring and damper between a point of a link and a point of another."""

    i: int
    at_i: Array
    j: int
    at_j: Array
    stiffness: float
    damping: float
    length: float


@dataclass(frozen=True)
class Motor:
    """A torque along one of the tree's hinges: a constant, or one that follows swing (1 - cos(speed t)) by a PD law."""

    axis: int  # number of the hinge, in the order of links and axes
    stiffness: float = 0.0
    damping: float = 0.0
    swing: float = 0.0
    speed: float = 0.0
    torque: float = 0.0

    def law(self) -> str:
        """The torque as an expression of t, angle and rate."""
        if not self.stiffness:
            return repr(self.torque)
        return following(self.stiffness, self.damping, self.swing, self.speed)


@dataclass(frozen=True)
class Tree:
    """A mechanism. ``rates``: of all joints of the tree at the start, in the order of links and axes.

    Links are in depth-first order, branch by branch: MuJoCo counts so, and Pinocchio is silently wrong otherwise.
    """

    name: str
    gravity: Array
    links: tuple[Link, ...]
    cuts: tuple[Cut, ...]
    rates: Array
    springs: tuple[Spring, ...] = ()
    redundant: bool = False  # whether some row of its joints repeats others
    motors: tuple[Motor, ...] = ()

    def __post_init__(self) -> None:
        branch: list[int] = []
        for k, link in enumerate(self.links):
            while branch and branch[-1] != link.parent:
                branch.pop()
            if not branch and link.parent != GROUND:
                raise ValueError(f"{self.name}: link {link.name!r} is out of depth-first order")
            branch.append(k)

    @property
    def axes(self) -> list[Axis]:
        """All joints of the tree."""
        return [a for link in self.links for a in link.axes]


def mounted(link: Link) -> bool:
    """Whether a link hangs in a rubber mount: three slides along x, y, z and three hinges, with springs."""
    return len(link.axes) == 6 and link.axes[0].stiffness > 0.0


def springs_of(link: Link) -> tuple[list[float], list[float]]:
    """Stiffness and damping of all its axes."""
    return [a.stiffness for a in link.axes], [a.damping for a in link.axes]


class Motion(NamedTuple):
    """Centres of mass, rotations, their velocities and angular velocities; world components, (times, links, ...)."""

    position: Array
    rotation: Array
    velocity: Array
    spin: Array


def twist_columns(tree: Tree) -> Array:
    """Angular velocity and velocity at the world's origin of every link as drawn, per rate: (links, 6, joints)."""
    out = np.zeros((len(tree.links), 6, len(tree.axes)))
    n = 0
    for k, link in enumerate(tree.links):
        if link.parent != GROUND:
            out[k] = out[link.parent]
        for a in link.axes:
            out[k, :, n] = np.r_[a.direction, np.cross(a.point, a.direction)] if a.kind == "hinge" else 0.0
            if a.kind == "slide":
                out[k, 3:, n] = a.direction
            n += 1
    return out


def point_velocity(columns: Array, k: int, x: Array) -> Array:
    """Of a point of link k, per rate: (3, joints)."""
    if k == GROUND:
        return np.zeros((3, columns.shape[2]))
    return columns[k, 3:] + np.cross(columns[k, :3], x, axisa=0, axisc=0)


def closed(tree: Tree, known: dict[int, float]) -> Tree:
    """The tree with rates that keep its cuts closed; ``known`` are those of some joints, by number."""
    columns = twist_columns(tree)
    rows = [point_velocity(columns, c.i, x) - point_velocity(columns, c.j, x) for c in tree.cuts for x in c.points]
    A = np.vstack([*rows, np.eye(len(tree.axes))[list(known)]])
    b = np.r_[np.zeros(3 * len(rows)), list(known.values())]
    rates, _, rank, _ = np.linalg.lstsq(A, b, rcond=1e-10)
    if np.abs(A @ rates - b).max() > 1e-12 or rank < len(rates):
        raise ValueError(f"{tree.name}: the rates given do not determine the motion")
    return replace(tree, rates=rates)


def start_twists(tree: Tree) -> tuple[Array, Array]:
    """Velocities of the centres and angular velocities at the start, each (links, 3)."""
    twists = twist_columns(tree) @ tree.rates
    centres = np.array([link.centre for link in tree.links])
    return twists[:, 3:] + np.cross(twists[:, :3], centres), twists[:, :3]


def moved(m: Motion, tree: Tree, k: int, x: Array) -> Array:
    """Where a point of link k, drawn at x, is: (times, 3)."""
    if k == GROUND:
        return np.broadcast_to(x, (len(m.position), 3))
    return m.position[:, k] + m.rotation[:, k] @ (x - tree.links[k].centre)


def energy(tree: Tree, m: Motion) -> Array:
    """Kinetic and potential energy over time [J], springs between points and along slides included."""
    mass = np.array([link.mass for link in tree.links])
    spin = np.einsum("tkji,tkj->tki", m.rotation, m.spin)  # along the link's axes
    inertia = np.array([link.inertia for link in tree.links])
    out = 0.5 * (mass * (m.velocity**2).sum(axis=2)).sum(axis=1)
    out += 0.5 * np.einsum("tki,kij,tkj->t", spin, inertia, spin)
    out -= m.position @ tree.gravity @ mass
    for k, link in enumerate(tree.links):
        for a in link.axes:
            if a.stiffness and a.kind == "slide":
                d = moved(m, tree, k, a.point) - moved(m, tree, link.parent, a.point)
                R = np.eye(3) if link.parent == GROUND else m.rotation[:, link.parent]
                out += 0.5 * a.stiffness * ((d * (R @ a.direction)).sum(axis=1) - a.rest) ** 2
    for s in tree.springs:
        length = np.linalg.norm(moved(m, tree, s.j, s.at_j) - moved(m, tree, s.i, s.at_i), axis=1)
        out += 0.5 * s.stiffness * (length - s.length) ** 2
    return out


def gap(tree: Tree, m: Motion) -> float:
    """Largest distance in one coordinate between the points that a cut joint holds together [m]."""
    gaps = [moved(m, tree, c.i, x) - moved(m, tree, c.j, x) for c in tree.cuts for x in c.points]
    return max((float(np.abs(g).max()) for g in gaps), default=0.0)


def planar_tree(p: Planar) -> Tree:
    """A planar mechanism of hinges as a tree: a hinge that reaches a new body hangs it, any other closes a loop."""
    at = [drawn(p, i, a) for i, a, _, _ in p.hinges]
    hangs: dict[int, list[int]] = {}  # hinges that hang bodies on each body
    cut, reached = [], {GROUND}
    for h, (i, _, j, _) in enumerate(p.hinges):
        if j in reached:
            cut.append(h)
        else:
            reached.add(j)
            hangs.setdefault(i, []).append(h)
    place = {GROUND: GROUND}
    links: list[Link] = []
    rates = []
    waiting = hangs[GROUND][::-1]
    while waiting:
        h = waiting.pop()
        i, _, j, _ = p.hinges[h]
        place[j] = len(links)
        inertia, centre = float(p.inertia[j]) * np.eye(3), np.r_[p.start[j, :2], 0.0]
        hinge = (Axis("hinge", at[h], np.array([0.0, 0.0, 1.0])),)
        links.append(Link(f"rod{j}", float(p.mass[j]), inertia, centre, place[i], hinge))
        rates.append(p.rate[j, 2] - (0.0 if i == GROUND else p.rate[i, 2]))
        waiting += hangs.get(j, [])[::-1]
    cuts = tuple(Cut(place[p.hinges[h][0]], place[p.hinges[h][2]], at[h]) for h in cut)
    springs = tuple(
        Spring(place.get(i, GROUND), drawn(p, i, a), place.get(j, GROUND), drawn(p, j, b), k, 0.0, length)
        for i, a, j, b, k, length in p.springs
    )
    motors = tuple(Motor(place[p.hinges[h][2]], *law) for h, *law in p.motors)
    if any(links[place[body]].parent != GROUND for body, _ in p.torques):
        raise ValueError(f"{p.name}: a torque on a body that does not hang on ground is no hinge's")
    motors += tuple(Motor(place[body], torque=torque) for body, torque in p.torques)
    gravity = np.array([0.0, -p.gravity, 0.0])
    return Tree(p.name, gravity, tuple(links), cuts, np.array(rates), springs, motors=motors)


def drawn(p: Planar, body: int, at: tuple[float, float]) -> Array:
    """Where a point of a planar body is at the start."""
    return np.r_[point(p.start[None], body, at)[0], 0.0]


def planar_motion(p: Planar, tree: Tree, m: Motion) -> tuple[Array, Array]:
    """Coordinates and rates (x, y, angle) of a planar mechanism's rods in its own order, (times, bodies, 3)."""
    order = np.argsort([int(link.name.removeprefix("rod")) for link in tree.links])
    angle = p.start[:, 2] + np.arctan2(m.rotation[:, order, 1, 0], m.rotation[:, order, 0, 0])
    q = np.concatenate([m.position[:, order, :2], angle[:, :, None]], axis=2)
    return q, np.concatenate([m.velocity[:, order, :2], m.spin[:, order, 2:]], axis=2)


def flyball_tree(tree: Tree) -> fb.Mechanism:
    """The same mechanism, described to flyball: joints are joints, wherever the tree was cut."""
    m = fb.Mechanism(tree.name, gravity=tuple(tree.gravity.tolist()))
    velocity, spin = start_twists(tree)
    names = [*(link.name for link in tree.links), "ground"]
    for k, link in enumerate(tree.links):
        m.add(fb.Body(link.name, mass=link.mass, inertia=link.inertia, position=link.centre, velocity=velocity[k],
                      angular_velocity=spin[k]))  # fmt: skip
        add_joint(m, f"joint {k}", names[link.parent], link)
    for k, c in enumerate(tree.cuts):
        ends = names[c.i], names[c.j]
        joint = fb.Revolute(f"cut {k}", *ends, at=c.point, axis=c.axis) if c.axis is not None else None
        m.add(joint or fb.Spherical(f"cut {k}", *ends, at=c.point))
    carried = [k for k, link in enumerate(tree.links) for _ in link.axes]
    for k, motor in enumerate(tree.motors):
        m.add(fb.Motor(f"motor {k}", f"joint {carried[motor.axis]}", torque=motor.law()))
    for k, s in enumerate(tree.springs):
        m.add(fb.SpringDamper(f"spring {k}", names[s.i], names[s.j], at=(s.at_i, s.at_j), stiffness=s.stiffness,
                              damping=s.damping, length=s.length))  # fmt: skip
    return m


def add_joint(m: fb.Mechanism, name: str, parent: str, link: Link) -> None:
    """A chain of hinges and slides as one of flyball's joints, or a mount; six freedoms are no joint."""
    kinds = [a.kind for a in link.axes]
    first = link.axes[0]
    if kinds == ["hinge"]:
        m.add(fb.Revolute(name, parent, link.name, at=first.point, axis=first.direction))
        if first.stiffness or first.damping:
            held = {"stiffness": first.stiffness, "damping": first.damping, "angle": first.rest}
            m.add(fb.TorsionalSpringDamper(f"spring of {name}", name, **held))
    elif kinds == ["hinge", "hinge"]:
        axes = (first.direction, link.axes[1].direction)
        m.add(fb.Universal(name, parent, link.name, at=first.point, axes=axes))
    elif kinds == ["slide"]:
        m.add(fb.Prismatic(name, parent, link.name, at=first.point, axis=first.direction))
        if first.stiffness:
            spring = {"stiffness": first.stiffness, "rest": first.rest}
            m.add(fb.CoordinateSpring(f"spring of {name}", f"{name}.displacement", **spring))
    elif mounted(link):
        k, c = springs_of(link)
        m.add(fb.Bushing(name, parent, link.name, at=first.point, stiffness=k[:3], damping=c[:3],
                         torsional_stiffness=k[3:], torsional_damping=c[3:]))  # fmt: skip
    elif len(kinds) != 6:
        raise ValueError(f"{name}: no joint of flyball is a chain of {kinds}")


def flyball_motion(tree: Tree, run: fb.Result) -> Motion:
    """Motion of the links in flyball's result."""
    views = [run[link.name] for link in tree.links]
    parts = ("position", "rotation", "velocity", "angular_velocity")
    return Motion(*(np.stack([getattr(v, part) for v in views], axis=1) for part in parts))
