"""Families of random mechanisms: any of them comes from its name and a seed alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import flyball as fb

from .dice import Dice, plus
from .forces import FORCES, driven, law, stiffness
from .joints import coordinates, coupling, joint, rotations
from .shaken import MAKERS, noted
from .stiffened import stiffened
from .switching import switched


@dataclass
class Case:
    """A mechanism, how long it is to run, and what adding its parts was refused with."""

    mechanism: fb.Mechanism
    t_end: float
    options: dict[str, Any] = field(default_factory=dict)
    refused: list[str] = field(default_factory=list)

    def add(self, maker) -> bool:
        """Add what ``maker`` makes, if anything; a refusal is kept."""
        try:
            e = maker()
            if e is not None:
                self.mechanism.add(e)
        except fb.ModelError as error:
            self.refused.append(str(error))
            return False
        return e is not None


def _body(d: Dice, name: str, p, wild: bool) -> fb.Body:
    """A compact, slender, flat or extreme body at p."""
    mass = d.size(1e-3, 1e3) if wild else d.size(0.3, 3.0)
    size = d.size(0.01, 1.0) if wild else 0.2
    moving = {} if d.chance(0.5) else {"velocity": d.vector(2.0)}
    if d.planar:
        return fb.Body(
            name, mass=mass, inertia=mass * size**2 * (0.0 if wild and d.chance(0.1) else 1.0), position=p,
            angle=d.number(-3, 3), com=d.pick([(0.0, 0.0), d.vector(0.2)]), angular_velocity=d.pick([0.0, d.number(-5, 5)]), **moving,
        )  # fmt: skip
    a, b = d.number(0.3, 1.0), d.number(0.3, 1.0)
    thin = d.pick([1e-2, 1e-6, 1e-9, 0.0]) if wild else d.pick([1.0, 0.1])
    moments = (a + thin * b, b + thin * a, a + b) if d.chance(0.3) else (a * thin, a, a)
    return fb.Body(
        name, mass=mass, inertia=[mass * size**2 * x for x in moments], position=p, com=d.pick([(0.0,) * 3, d.vector(0.2)]),
        orientation=tuple(d.number(-1, 1) for _ in range(3)), angular_velocity=d.pick([None, d.vector(3.0)]), **moving,
    )  # fmt: skip


def start(d: Dice, name: str) -> fb.Mechanism:
    gravity = (0, -9.81) if d.planar else (0, 0, -9.81)
    return fb.Mechanism(name, planar=d.planar, gravity=d.pick([gravity, gravity, None]))


def tree(d: Dice, m: fb.Mechanism, case: Case, n: int, *, chain: bool = False, wild: bool = False, kinds=None) -> None:
    """Bodies, each joined to ground or to one before."""
    points = {"ground": (0.0,) * (2 if d.planar else 3)}
    for k in range(1, n + 1):
        parent = f"b{k - 1}" if chain and k > 1 else d.pick(points) if k > 1 else "ground"
        p = d.near(points[parent], 0.4)
        name = f"b{k}"
        case.add(lambda p=p, name=name: _body(d, name, plus(p, d.size(0.01, 0.5), d.direction()), wild))
        points[name] = m[name].position
        while not case.add(lambda name=name, p=p, parent=parent: joint(d, f"J{name}", parent, name, p, kinds)):
            pass


def close(d: Dice, m: fb.Mechanism, case: Case, count: int, kinds=None) -> None:
    """Joints that close loops."""
    names = ["ground", *(b.name for b in m.bodies)]
    for k in range(count):
        i, j = d.random.sample(names, 2)
        p = d.near(m[j].position if j != "ground" else m[i].position, 0.3)
        case.add(lambda i=i, j=j, p=p, k=k: joint(d, f"L{k}", i, j, p, kinds))


def dress(d: Dice, m: fb.Mechanism, case: Case, *, most: int = 3, stiff: bool = False, kinds=None) -> None:
    """Sensors, a table, forces of any kind."""
    if d.chance(0.5):
        case.add(lambda: fb.Table("curve", x=(-1, 0, 0.5, 2), y=(0, 1, 0.3, -1), beyond=d.pick(["hold", "line"])))
    for k, c in enumerate(d.random.sample(coordinates(m), min(2, len(coordinates(m))))):
        case.add(lambda k=k, c=c: fb.Sensor(f"s{k}", c))
    names = ["ground", *(b.name for b in m.bodies)]
    for k in range(d.whole(0, most)):
        i, j = d.random.sample(names, 2)
        i, j = (j, i) if j == "ground" else (i, j)
        p = d.near(m[j].position, 0.3)
        make = FORCES[d.pick(kinds or FORCES)]
        case.add(lambda k=k, i=i, j=j, p=p, make=make: make(d, m, f"F{k}", i, j, p, stiff))


def drive(d: Dice, m: fb.Mechanism, case: Case, count: int) -> None:
    """Drivers on coordinates of joints or of bodies."""
    bodies = [f"{b.name}.{a}" for b in m.bodies for a in ("xy" if m.planar else "xyz")]
    for k in range(count):
        c = d.pick((coordinates(m) or bodies) if d.chance(0.8) else bodies)
        # a driver of a body's place begins where the body is
        begin = f"{m[c[:-2]].position['xyz'.index(c[-1])]!r} + " if c in bodies else ""
        case.add(lambda k=k, c=c, begin=begin: fb.Driver(f"D{k}", c, begin + driven(d)))


def _case(d: Dice, name: str, t_end: float, **options) -> tuple[Case, fb.Mechanism]:
    m = start(d, name)
    return Case(m, t_end, options), m


def chains(d: Dice) -> Case:
    case, m = _case(d, "chain", 0.5)
    tree(d, m, case, d.whole(1, 6), chain=True)
    case.options["stabilization"] = d.pick(["projection", "projection", "projection-steps", "baumgarte"])
    if case.options["stabilization"] != "projection":  # in joint coordinates nothing would be left to stabilize
        case.options["coordinates"] = "absolute"
    return case


def trees(d: Dice) -> Case:
    case, m = _case(d, "tree", 0.5)
    tree(d, m, case, d.whole(2, 8))
    dress(d, m, case)
    return case


def loops(d: Dice) -> Case:
    case, m = _case(d, "loops", 0.5)
    tree(d, m, case, d.whole(2, 6))
    close(d, m, case, d.whole(1, 3))
    dress(d, m, case, most=2)
    return case


def redundant(d: Dice) -> Case:
    """Hinges and slides twice on the same axis, parallel four-bars with more cranks than needed."""
    case, m = _case(d, "redundant", 0.5)
    tree(d, m, case, d.whole(1, 4), kinds=["Revolute", "Prismatic"] if d.chance(0.7) else None)
    for k, j in enumerate(list(m.joints)):
        if d.chance(0.7) and j.axis is not None and not isinstance(j, fb.Screw):
            at = plus(j.at, d.number(0.05, 0.4), j.axis)
            case.add(lambda k=k, j=j, at=at: type(j)(f"R{k}", j.body_i, j.body_j, at=at, axis=j.axis))
        elif d.chance(0.5):
            axis = {} if d.planar else {"axis": j.axis or d.direction()}
            at = j.at if len(j.at) != 2 or d.planar else j.at[0]
            case.add(lambda k=k, j=j, at=at, axis=axis: fb.Revolute(f"R{k}", j.body_i, j.body_j, at=at, **axis))
    dress(d, m, case, most=2)
    return case


def parallel_cranks(d: Dice) -> Case:
    """A bar on two to four parallel cranks: redundant in the plane beyond two, in space always; singular twice a turn."""
    case, m = _case(d, "parallel cranks", d.pick([0.5, 2.0]))
    n, r = d.whole(2, 4), 0.3
    a = d.pick([0.0, math.pi / 2, math.pi, 1.0, 1e-6, -1e-9])
    error = d.pick([0.0, 0.0, 1e-12, 1e-9, 1e-6])
    flat = (lambda *p: p) if d.planar else (lambda *p: (*p, 0.0))
    turn, w = ({}, 4.0) if d.planar else ({"axis": (0, 0, 1)}, (0, 0, 4.0))
    inertia = 0.01 if d.planar else (0.01, 0.01, 0.01)
    m.add(fb.Body("bar", mass=1, inertia=inertia, position=flat(0.5 + r * math.cos(a), r * math.sin(a))))
    for k in range(n):
        b = a + error * d.number(-1, 1)
        tip = flat(k * 0.5 + r * math.cos(b), r * math.sin(b))
        m.add(fb.Body(f"crank {k}", mass=1, inertia=inertia, position=flat(k * 0.5, 0.0), angular_velocity=w))
        m.add(fb.Revolute(f"A{k}", "ground", f"crank {k}", at=flat(k * 0.5, 0.0), **turn))
        m.add(fb.Revolute(f"B{k}", f"crank {k}", "bar", at=tip, **turn))
    if d.chance(0.3):
        m.add(fb.Driver("D", "A0.angle", "4*t"))
    return case


def singular(d: Dice) -> Case:
    """Four-bars, slider-cranks and pendulums drawn stretched, folded, or all but so."""
    case, m = _case(d, "singular", d.pick([0.3, 1.0]))
    off = d.pick([0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
    flat = (lambda *p: p) if d.planar else (lambda *p: (*p, 0.0))
    turn = {} if d.planar else {"axis": (0, 0, 1)}
    inertia = 0.01 if d.planar else (0.01, 0.02, 0.02)
    lengths = [d.pick([0.2, 0.3, 0.5]) for _ in range(d.whole(2, 3))]
    places, x = [flat(0.0, 0.0)], 0.0
    for k, length in enumerate(lengths):
        x += length * (d.pick([1, 1, -1]) if k else 1)
        places.append(flat(x, off * d.number(-1, 1)))
    names = ["ground", *(f"link {k}" for k in range(len(lengths)))]
    w = {} if d.chance(0.5) else {"angular_velocity": 3.0 if d.planar else (0, 0, 3.0)}
    for k, name in enumerate(names[1:]):
        middle = tuple((p + q) / 2 for p, q in zip(places[k], places[k + 1], strict=True))
        m.add(fb.Body(name, mass=d.size(0.1, 10), inertia=inertia, position=middle, **(w if k == 0 else {})))
        m.add(fb.Revolute(f"P{k}", names[k], name, at=places[k], **turn))
    end = d.pick(["Revolute", "Translational" if d.planar else "Prismatic", "PointOnLine"])
    axis = turn if end == "Revolute" else {"axis": flat(*d.pick([(1, 0), (0, 1)]))}
    if end in ("Translational", "Prismatic"):
        m.add(fb.Body("slider", mass=1, inertia=inertia, position=places[-1]))
        m.add(fb.Revolute("pin", names[-1], "slider", at=places[-1], **turn))
    case.add(lambda: getattr(fb, end)("end", "ground", m.bodies[-1].name, at=places[-1], **axis))
    if d.chance(0.4):
        case.add(lambda: fb.Driver("D", "P0.angle", driven(d)))
    return case


def extremes(d: Dice) -> Case:
    """Masses over six orders, slender and massless bodies, stiff springs."""
    case, m = _case(d, "extremes", d.pick([0.01, 0.1, 0.5]))
    tree(d, m, case, d.whole(1, 5), wild=True)
    close(d, m, case, d.whole(0, 1))
    dress(d, m, case, most=2, stiff=True)
    return case


def stiff(d: Dice) -> Case:
    """Springs, mounts and dampers up to 1e9 N/m between ordinary bodies, by the implicit method."""
    case, m = _case(d, "stiff", d.pick([0.2, 1.0]), method="radau")
    tree(d, m, case, d.whole(1, 5))
    close(d, m, case, d.pick([0, 0, 1, 1, 2]))
    stiffened(d, m, case, 3)
    case.options["max_steps"] = 100_000
    return case


def drivers(d: Dice) -> Case:
    case, m = _case(d, "drivers", 0.5)
    tree(d, m, case, d.whole(1, 4))
    close(d, m, case, d.pick([0, 0, 1]))
    drive(d, m, case, d.pick([1, 1, 1, 2, 3]))
    dress(d, m, case, most=1)
    return case


def orientations(d: Dice) -> Case:
    """Ball joints and bodies whose angles are driven, stopped, sprung and read by laws, singular positions included."""
    case, m = _case(d, "orientations", 0.5)
    tree(d, m, case, d.whole(1, 3), kinds=["Revolute"] if d.planar else ["Spherical", "Spherical", "Revolute"])
    found = [f"{b.name}.angle" for b in m.bodies] if d.planar else rotations(m)
    for k in range(d.whole(1, 3)):
        c = d.pick(found)
        case.add(lambda k=k, c=c: fb.Sensor(f"s{k}", c))
        make = d.pick(
            [
                lambda k=k, c=c: fb.CoordinateSpring(
                    f"F{k}", c, stiffness=stiffness(d, False), damping=d.pick([0, 0.1])
                ),
                lambda k=k, c=c: fb.Actuator(f"F{k}", c, force=law(d, m, 1.0, ("value", "rate"))),
                lambda k=k, c=c: fb.Limit(f"F{k}", c, upper=d.number(0.05, 1.0), stiffness=d.pick([None, 100.0])),
                lambda k=k, c=c: fb.Driver(f"D{k}", c, driven(d)),
                lambda k=k, c=c: fb.Event(
                    f"E{k}", f"t > {d.number(0.1, 0.4)}", do=[fb.Lock(c if c.startswith("J") else "Jb1")]
                ),
            ]
        )
        case.add(make)
    return case


def couplings(d: Dice) -> Case:
    case, m = _case(d, "couplings", 0.5)
    tree(d, m, case, d.whole(2, 5), kinds=["Revolute", "Prismatic", "Cylindrical"][: 2 if d.planar else 3])
    close(d, m, case, d.whole(0, 1))
    for k in range(d.whole(1, 3)):
        case.add(lambda k=k: coupling(d, m, f"C{k}"))
    dress(d, m, case, most=2)
    if d.chance(0.3):
        drive(d, m, case, 1)
    return case


def curves(d: Dice) -> Case:
    """Points on curves, flat-faced cams, linear actuators, nonlinear constraints."""
    case, m = _case(d, "curves", 0.5)
    tree(d, m, case, d.whole(1, 3), kinds=["Revolute", "Prismatic", "PointOnCurve"])
    close(d, m, case, d.whole(0, 2), kinds=["FlatFacedCam", "PointOnCurve", "LinearActuator", "Cam"])
    for k in range(d.whole(0, 2)):
        case.add(lambda k=k: coupling(d, m, f"C{k}", ("Constraint", "Coupler")))
    dress(d, m, case, most=2)
    return case


def friction(d: Dice) -> Case:
    case, m = _case(d, "friction", 0.2)
    tree(d, m, case, d.whole(1, 3), kinds=["Revolute", "Prismatic"])
    close(d, m, case, d.whole(0, 1))
    dress(d, m, case, most=3, kinds=["JointFriction", "JointFriction", "SpringDamper", "PointForce"])
    return case


def windows(d: Dice) -> Case:
    """The N-four-bar, which passes positions where all its windows are flat, at any tolerance."""
    case, m = _case(d, "windows", d.pick([1.0, 3.0]), rtol=d.pick([1e-4, 1e-6, 1e-8, 1e-10, 1e-12]))
    case.options["atol"] = case.options["rtol"] / 100
    case.options["method"] = d.pick(["dop853", "rk45"])
    flat = (lambda *p: p) if d.planar else (lambda *p: (*p, 0.0))
    turn, inertia = ({}, 1 / 12) if d.planar else ({"axis": (0, 0, 1)}, (1e-7, 1 / 12, 1 / 12))
    n = d.whole(1, 4)
    for k in range(n + 1):
        rod = {} if d.planar else {"orientation": (math.sqrt(0.5), 0, 0, math.sqrt(0.5))}
        m.add(fb.Body(f"post {k}", mass=1, inertia=inertia, position=flat(k, 0.5), **rod))
        m.add(fb.Revolute(f"A{k}", "ground", f"post {k}", at=flat(k, 0.0), **turn))
    for k in range(n):
        m.add(fb.Body(f"beam {k}", mass=1, inertia=inertia, position=flat(k + 0.5, 1.0)))
        m.add(fb.Revolute(f"B{k}", f"post {k}", f"beam {k}", at=flat(k, 1.0), **turn))
        m.add(fb.Revolute(f"C{k}", f"beam {k}", f"post {k + 1}", at=flat(k + 1, 1.0), **turn))
    m.add(fb.Initial("A0.angle", rate=d.pick([-1.0, -1.0, -5.0, 0.0])))
    return case


def crowds(d: Dice) -> Case:
    """Many bodies for a short time."""
    case, m = _case(d, "crowd", 0.05)
    tree(d, m, case, d.whole(20, 60), chain=d.chance(0.5))
    close(d, m, case, d.whole(0, 4))
    return case


def _switching(d: Dice, name: str, kinds: list[str], most: int = 3) -> Case:
    """A tree, at times with a loop, with parts that hold at times."""
    case, m = _case(d, name, d.pick([0.5, 1.0]))
    tree(d, m, case, d.whole(1, 4), kinds=["Revolute", "Prismatic", "Revolute"])
    close(d, m, case, d.pick([0, 0, 0, 1]))
    switched(d, m, case, kinds, most)
    return case


def stops(d: Dice) -> Case:
    """Limits and play, rigid and elastic."""
    return _switching(d, "stops", ["Limit", "Limit", "Backlash"])


def sticking(d: Dice) -> Case:
    """Friction that sticks, brakes, clutches."""
    return _switching(d, "sticking", ["JointFriction", "JointFriction", "Brake", "Clutch"])


def ropes(d: Dice) -> Case:
    """Ropes that go slack and taut."""
    return _switching(d, "ropes", ["Rope"], 2)


def latches(d: Dice) -> Case:
    """Freewheels and ratchets."""
    return _switching(d, "latches", ["OneWay", "Ratchet"], 2)


def happenings(d: Dice) -> Case:
    """Events, and whatever else switches."""
    kinds = ["Event", "Event", "Limit", "Brake", "JointFriction", "Rope", "OneWay"]
    return _switching(d, "happenings", kinds, 4)


def shaken(d: Dice) -> Case:
    """What holds at times under loads that go to and fro, some of it at rest for long."""
    make = d.pick(MAKERS)
    if make.__name__ == "landing":
        d.planar = False
    case, m = _case(d, "shaken", d.pick([3.0, 8.0]), outputs=401)
    make(d, m, case)
    if d.chance(0.4):
        noted(d, m, case)
    return case


FAMILIES = {
    f.__name__: f
    for f in (
        chains, trees, loops, redundant, parallel_cranks, singular, windows, extremes, stiff, drivers, orientations, couplings, friction,
        crowds, stops, sticking, ropes, latches, happenings, shaken, curves,
    )
}  # fmt: skip


def made(family: str, seed: int) -> Case:
    """The mechanism of a family and a seed: planar for even seeds, spatial for odd ones."""
    return FAMILIES[family](Dice(seed, planar=seed % 2 == 0))
