"""New kinds of random mechanisms: controllers, functions, tables, events, bodies in free flight, gears, wheels."""

from __future__ import annotations

import math
from typing import Any

from tests.robust.dice import Dice, plus
from tests.robust.families import FAMILIES as KNOWN
from tests.robust.families import Case, close, dress, start, tree
from tests.robust.joints import coordinates
from tests.robust.switching import switched

import flyball as fb

from .scaling import python_law

SIMPLE = ["Revolute", "Prismatic", "Revolute"]


def _case(d: Dice, name: str, t_end: float, **options: Any) -> tuple[Case, fb.Mechanism]:
    m = start(d, name)
    return Case(m, t_end, options), m


def _coordinate(d: Dice, m: fb.Mechanism) -> str | None:
    found = [c for c in coordinates(m) if c.endswith((".angle", ".displacement"))]
    return d.pick(found) if found else None


def _effort(d: Dice, m: fb.Mechanism, name: str, c: str, law: Any) -> Any:
    if c.endswith(".angle") and not isinstance(m[c[:-6]], fb.Planar):
        return fb.Motor(name, c[:-6], torque=law)
    return fb.Actuator(name, c, force=law)


def _pid(d: Dice, c: str, name: str, sampled: bool) -> fb.PID:
    more: dict[str, Any] = {"filter": d.pick([0.01, 0.05]), "kd": d.number(0.1, 3)}
    if sampled:
        more["period"] = d.pick([0.01, 0.02, 0.017])
    if d.chance(0.5):
        more |= {
            "lower": -d.size(1, 20),
            "upper": d.size(1, 20),
            "anti_windup": d.pick(["clamping", "none", "back-calculation"]),
        }
        if more["anti_windup"] == "back-calculation":
            more["tracking"] = 0.1
    setpoint = d.pick([f"{d.number(-0.5, 0.5)}", f"0.3*sin({d.number(2, 9)}*t)", "step(t, 0.05, 0.0, 0.3, 0.4)"])
    return fb.PID(name, setpoint=setpoint, measured=c, kp=d.size(1, 60), ki=d.pick([0.0, d.size(1, 30)]), **more)


def _filter(d: Dice, c: str, name: str, sampled: bool) -> Any:
    """A state space, a lag, a transfer function, an integrator or an equation of its own."""
    period = {"period": d.pick([0.01, 0.02])} if sampled else {}
    kind = d.whole(0, 4)
    if kind == 0:
        w, z = d.number(5, 30), d.number(0.3, 1.2)
        A, B = ((0.0, 1.0), (-w * w, -2 * z * w)), ((0.0,), (w * w,))
        if sampled:
            A, B = ((0.9, 0.1), (-0.2, 0.7)), ((0.0,), (0.3,))
        return fb.StateSpace(name, inputs=[f"{d.number(1, 9)}*({c})"], A=A, B=B, C=((1.0, 0.1),), D=((0.2,),), **period)
    if kind == 1:
        return fb.Lag(
            name,
            of=f"-{d.number(1, 20)}*({c})",
            time=d.size(0.01, 0.3),
            gain=d.number(0.5, 2),
            lead=d.pick([0.0, 0.02]),
            **period,
        )
    if kind == 2 and not sampled:
        return fb.Transfer(
            name, of=f"-{d.number(1, 9)}*({c})", num=(d.number(1, 50),), den=(1.0, d.number(2, 20), d.number(10, 90))
        )
    if kind == 3 and not sampled:
        return fb.State(name, rate=f"-{name}*{d.number(1, 9)} - {d.number(1, 9)}*({c})", initial=d.number(-1, 1))
    return fb.Integrator(name, of=f"-{d.number(1, 9)}*({c})", gain=d.number(0.5, 5), **period)


def controllers(d: Dice) -> Case:
    """Continuous PID, state spaces, lags, transfer functions, in series with motors."""
    return _controlled(d, sampled=False)


def sampled(d: Dice) -> Case:
    """The same at instants; two of them, with periods of their own."""
    return _controlled(d, sampled=True)


def _controlled(d: Dice, sampled: bool) -> Case:
    case, m = _case(d, "controlled", d.pick([0.3, 0.5]))
    tree(d, m, case, d.whole(1, 3), kinds=SIMPLE)
    close(d, m, case, d.pick([0, 0, 0, 1]), kinds=["Distance", "Revolute"])
    for k in range(d.whole(1, 2)):
        c = _coordinate(d, m)
        if c is None:
            continue
        make = d.pick([_pid, _filter])
        if case.add(lambda c=c, k=k, make=make: make(d, c, f"con{k}", sampled)):
            case.add(lambda c=c, k=k: _effort(d, m, f"M{k}", c, d.pick([f"con{k}", f"0.5*con{k} - 0.1*rate"])))
    dress(d, m, case, most=1)
    return case


def functions(d: Dice) -> Case:
    """Laws that are Python functions."""
    case, m = _case(d, "functions", 0.3)
    tree(d, m, case, d.whole(1, 3), kinds=SIMPLE)
    c = _coordinate(d, m)
    if c is not None:
        text = d.pick(["3.0*sin(5.0*t) - 0.5*rate", "-4.0*tanh({x}) - 0.1*rate", "2.0*cos({x} + t)"])
        x = "angle" if c.endswith(".angle") else "value"
        law = python_law(("t", x, "rate"), text.replace("{x}", x))
        case.add(lambda: _effort(d, m, "P0", c, law))
    body = d.pick(m.bodies)
    ends = (plus(body.position, d.size(0.3, 1.0), d.direction()), body.position)
    pull = python_law(("t", "length", "rate"), "8.0*(length - 0.4) + 0.3*rate + 0.5*sin(9.0*t)")
    case.add(lambda: fb.SpringDamper("P1", "ground", body.name, at=ends, force=pull))
    return case


def tables(d: Dice) -> Case:
    """Laws and drivers by tables of all kinds."""
    case, m = _case(d, "tables", 0.4)
    tree(d, m, case, d.whole(1, 3), kinds=SIMPLE)
    for k in range(2):
        xs = [-1.0]
        for _ in range(5):
            xs.append(xs[-1] + d.number(0.2, 0.9))
        ys = [d.number(-2, 2) for _ in xs]
        beyond = d.pick(["hold", "line", "repeat"])
        if beyond == "repeat":
            ys[-1] = ys[0]
        kind = d.pick(["cubic", "monotone", "linear"])
        case.add(
            lambda k=k, xs=xs, ys=ys, kind=kind, beyond=beyond: fb.Table(
                f"tab{k}", x=xs, y=ys, interpolation=kind, beyond=beyond
            )
        )
    for k in range(d.whole(1, 2)):
        c = _coordinate(d, m)
        if c is not None:
            x = "angle" if c.endswith(".angle") and not isinstance(m[c[:-6]], fb.Planar) else "value"
            case.add(
                lambda k=k, c=c, x=x: _effort(
                    d, m, f"T{k}", c, f"{d.number(0.5, 4)}*tab{k % 2}({d.pick([x, '5*t - 1', '2*rate'])})"
                )
            )
    if d.chance(0.4) and (c := _coordinate(d, m)):
        case.add(lambda c=c: fb.Driver("D", c, f"{d.number(0.1, 0.5)}*tab0(4*t - 1) - {d.number(0.1, 0.5)}*tab0(-1)"))
    return case


def isolated(d: Dice) -> Case:
    """Bodies in free flight, joined with one another and with springs, nothing with ground."""
    case, m = _case(d, "isolated", d.pick([0.5, 1.0, 2.0]))
    n, kinds = (
        d.whole(2, 4),
        (["Revolute", "Prismatic"] if d.planar else ["Revolute", "Spherical", "Universal", "Prismatic", "Cylindrical"]),
    )
    for k in range(n):
        mass, a = d.size(0.3, 3), d.number(0.05, 0.2)
        inertia = (
            mass * a * a if d.planar else tuple(mass * a * a * f for f in (d.number(0.8, 1.0), d.number(0.8, 1.0), 1.1))
        )
        spin = d.number(-3, 3) if d.planar else d.vector(3.0)
        m.add(
            fb.Body(
                f"b{k}",
                mass=mass,
                inertia=inertia,
                position=d.vector(0.5),
                velocity=d.vector(1.0),
                angular_velocity=spin,
                com=d.pick([None, d.vector(0.1)]),
            )
        )
    for k in range(1, n):
        p = d.near(m[f"b{k}"].position, 0.2)
        if d.chance(0.6):
            from tests.robust.joints import joint

            case.add(lambda k=k, p=p: joint(d, f"J{k}", f"b{d.whole(0, k - 1)}", f"b{k}", p, kinds))
        else:
            case.add(
                lambda k=k, p=p: fb.SpringDamper(
                    f"S{k}",
                    f"b{k - 1}",
                    f"b{k}",
                    at=(m[f"b{k - 1}"].position, p),
                    stiffness=d.size(1, 300),
                    damping=d.pick([0, 0.2]),
                    length=d.pick([None, 0.3]),
                )
            )
    for c in coordinates(m):
        if d.chance(0.4) and c.endswith((".angle", ".displacement")):
            name = f"K{len(m.forces)}"
            case.add(
                lambda c=c, name=name: fb.CoordinateSpring(
                    name, c, stiffness=d.size(0.5, 50), damping=d.pick([0, 0.1]), rest=d.number(-0.5, 0.5)
                )
            )
    return case


def lossless(d: Dice) -> Case:
    """Springs and weight only: energy is constant."""
    case, m = _case(d, "lossless", d.pick([0.5, 1.0]))
    tree(d, m, case, d.whole(1, 4), kinds=SIMPLE if d.planar else [*SIMPLE, "Spherical", "Universal", "Cylindrical"])
    close(
        d,
        m,
        case,
        d.pick([0, 0, 1]),
        kinds=["Distance", "Revolute", "Distance"] if d.planar else ["Distance", "Spherical", "PointInPlane"],
    )
    for k in range(d.whole(1, 3)):
        b = d.pick(m.bodies)
        ends = (plus(b.position, d.size(0.2, 1), d.direction()), d.near(b.position, 0.1))
        case.add(
            lambda k=k, b=b, ends=ends: fb.SpringDamper(
                f"S{k}", "ground", b.name, at=ends, stiffness=d.size(1, 200), length=d.pick([None, d.size(0.1, 1)])
            )
        )
    for k, c in enumerate(coordinates(m)):
        if d.chance(0.3) and c.endswith((".angle", ".displacement")):
            case.add(
                lambda k=k, c=c: fb.CoordinateSpring(f"C{k}", c, stiffness=d.size(0.5, 50), rest=d.number(-0.5, 0.5))
            )
    return case


def gears(d: Dice) -> Case:
    """Shafts and racks with gears, racks and couplers, springs, motors."""
    case, m = _case(d, "gears", d.pick([0.5, 2.0]))
    n = d.whole(2, 4)
    flat = (lambda *p: p) if d.planar else (lambda *p: (*p, 0.0))
    turn = {} if d.planar else {"axis": (0, 0, 1)}
    for k in range(n):
        inertia = d.size(0.01, 0.3)
        m.add(
            fb.Body(
                f"w{k}",
                mass=d.size(0.3, 3),
                inertia=inertia if d.planar else (inertia, inertia, 1.5 * inertia),
                position=flat(float(k), 0.0),
            )
        )
        m.add(fb.Revolute(f"A{k}", "ground", f"w{k}", at=flat(float(k), 0.0), **turn))
    m.add(fb.Body("rack", mass=d.size(0.3, 3), inertia=0.1 if d.planar else (0.1, 0.1, 0.1), position=flat(0.0, 1.0)))
    m.add(fb.Prismatic("G", "ground", "rack", at=flat(0.0, 1.0), axis=flat(*d.pick([(1, 0), (0, 1)]))))
    for k in range(1, n):
        teeth = (d.whole(10, 60), d.whole(10, 60))
        kind = d.pick(["gear", "gear", "coupler"])
        if kind == "gear":
            case.add(
                lambda k=k, teeth=teeth: fb.GearPair(
                    f"mesh{k}", f"A{k - 1}", f"A{k}", teeth=teeth, internal=d.chance(0.3)
                )
            )
        else:
            case.add(
                lambda k=k: fb.Coupler(f"mesh{k}", [f"A{k - 1}.angle", f"A{k}.angle"], weights=[1.0, d.number(-2, 2)])
            )
    if d.chance(0.7):
        case.add(lambda: fb.RackAndPinion("rp", "G", f"A{n - 1}", radius=d.size(0.05, 0.3)))
    if d.chance(0.5):
        case.add(lambda: fb.Initial("A0.angle", rate=d.number(-20, 20)))
    case.add(lambda: fb.Motor("M", "A0", torque=d.pick([f"{d.number(-2, 2)}*sin(6*t)", "1 - 0.1*rate", "0.5"])))
    case.add(lambda: fb.CoordinateSpring("S", "G.displacement", stiffness=d.size(1, 100), damping=d.pick([0, 1])))
    return case


def wheels(d: Dice) -> Case:
    """Rolling disks and balls, wheels on lines, skates, screws."""
    case, m = _case(d, "wheels", d.pick([0.5, 1.0]))
    if d.planar:
        r = d.size(0.05, 0.3)
        m.add(
            fb.Body(
                "w",
                mass=1,
                inertia=0.5 * r * r,
                position=(0, r),
                com=d.pick([None, (0.3 * r, 0)]),
                angular_velocity=d.number(-5, 5),
            )
        )
        m.add(fb.WheelOnLine("R", "ground", "w", at=(0, 0), axis=(1, 0), centre=(0, r)))
        m.add(fb.Body("p", mass=0.5, inertia=0.01, position=(0.0, r - 0.3)))
        m.add(fb.Revolute("H", "w", "p", at=(0, r)))
        if d.chance(0.5):
            case.add(lambda: fb.Motor("M", "H", torque="0.5*sin(3*t)"))
        return case
    r = d.size(0.05, 0.3)
    kind = d.pick(["ball", "disk", "screw"])
    if kind == "ball":
        m.add(fb.Body("w", mass=1, inertia=(0.4 * r * r,) * 3, position=(0, 0, r), angular_velocity=d.vector(4)))
        m.add(fb.RollingBall("R", "ground", "w", at=(0, 0, r), radius=r))
        case.add(
            lambda: fb.SpringDamper(
                "S", "ground", "w", at=((1, 1, 1), (0, 0, r)), stiffness=5, damping=d.pick([0, 0.3])
            )
        )
    elif kind == "disk":
        lean = d.number(-0.5, 0.5)
        m.add(
            fb.Body(
                "w",
                mass=1,
                inertia=(0.5 * r * r, 0.25 * r * r, 0.25 * r * r),
                position=(0, 0, r * math.cos(lean)),
                orientation=(0, lean, 0),
                angular_velocity=(d.number(3, 9), 0, d.number(-1, 1)),
            )
        )
        m.add(
            fb.RollingDisk(
                "R", "ground", "w", at=(0, 0, r * math.cos(lean)), axis=(math.cos(lean), 0, -math.sin(lean)), radius=r
            )
        )
    else:
        m.add(fb.Body("w", mass=1, inertia=(0.02, 0.02, 0.02), com=d.pick([None, (0.02, 0, 0)])))
        m.add(fb.Screw("R", "ground", "w", at=(0, 0, 0), axis=d.direction(), lead=d.pick([-1, 1]) * d.size(0.05, 1)))
        case.add(lambda: fb.PointTorque("T", "w", torque=("0.2", "0.1*sin(3*t)", "0.3")))
    return case


def eventful(d: Dice) -> Case:
    """Events of time and of coordinates: blows, locks, releases, stops, together with limits."""
    case, m = _case(d, "eventful", d.pick([0.4, 0.8]))
    tree(d, m, case, d.whole(1, 3), kinds=SIMPLE)
    switched(d, m, case, ["Limit", "Event"], 2)
    for k in range(d.whole(1, 2)):
        b = d.pick(m.bodies).name
        do: list[Any] = [fb.Impulse(b, d.vector(1.0))]
        c = _coordinate(d, m)
        when = (
            d.pick([f"t - {d.number(0.05, 0.3)}", f"{c} - {d.number(-0.1, 0.1)}", f"{c}_rate - {d.number(-0.5, 0.5)}"])
            if c
            else "t - 0.1"
        )
        if c and d.chance(0.3):
            do.append(fb.Lock(c))
        case.add(
            lambda k=k, when=when, do=do: fb.Event(
                f"E{k}", when, direction=d.pick(["rising", "falling", "either"]), do=do, times=d.pick([1, 2])
            )
        )
    return case


def pendula(d: Dice) -> Case:
    """Planar and spatial chains in special positions, with bodies of equal numbers: symmetry and ties."""
    case, m = _case(d, "pendula", d.pick([0.5, 1.0]))
    n, flat = d.whole(1, 4), ((lambda *p: p) if d.planar else (lambda *p: (p[0], 0.0, p[1])))
    turn = {} if d.planar else {"axis": (0, 1, 0)}
    for k in range(n):
        a = d.pick([0.0, 0.0, 0.5, -0.5])
        inertia = 1 / 12 if d.planar else (1e-3, 1 / 12, 1 / 12)
        m.add(fb.Body(f"b{k}", mass=1, inertia=inertia, position=flat(k + 0.5, 0.0)))
        m.add(fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=flat(float(k), 0.0), angle=a, **turn))
    if d.chance(0.5):
        case.add(lambda: fb.Initial("J0.angle", rate=d.number(-3, 3)))
    if d.chance(0.5):
        case.add(
            lambda: fb.TorsionalSpringDamper(
                "T", f"J{n - 1}", stiffness=d.size(1, 30), damping=d.pick([0, 0.3]), angle=d.pick([0.0, 0.7])
            )
        )
    if d.chance(0.5):
        case.add(lambda: fb.Driver("D", f"J{n - 1}.angle", f"{m[f'J{n - 1}'].angle!r} + 0.4*sin(5*t)"))
    return case


NEW = {
    f.__name__: f
    for f in (controllers, sampled, functions, tables, isolated, lossless, gears, wheels, eventful, pendula)
}
FAMILIES = {**NEW, **KNOWN}


def made(family: str, seed: int) -> Case:
    """The mechanism of a family and a seed: planar for even seeds, spatial for odd ones."""
    own = seed if family in KNOWN else f"{family} {seed}"  # type: ignore[assignment]
    return FAMILIES[family](Dice(own, planar=seed % 2 == 0))
