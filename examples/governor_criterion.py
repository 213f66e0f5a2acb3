"""Watt's governor on a steam engine: Vyshnegradskii's criterion of stability, and the limit cycle beyond it.

Balls of mass ``m`` (moment of inertia ``I`` about their own centres) on arms of length ``l`` at ``alpha`` from the
vertical lift a sleeve by links of the same length; all turn with the shaft of an engine (inertia ``J``) at ``W``. A
lever of length ``lever`` on the sleeve turns the throttle valve (inertia ``valve``). The engine's torque is the load's
while the sleeve stands as drawn, falls by ``k`` for each metre that it rises, and lies between 0 (valve shut) and
twice the load (valve open). A dashpot ``b`` damps the sleeve.

With too little damping the steady motion is unstable. The oscillation grows until the valve opens and shuts.

Run it with ``python examples/governor_criterion.py out``: it needs ``pip install 'flyball[symbolic]'``.
"""

import sys
from pathlib import Path

import flyball as fb

P = {"m": 1.0, "I": 0.01, "sleeve": 0.4, "l": 0.3, "alpha": 0.7, "J": 2.0, "k": 60.0, "b": 20.0}
P |= {"load": 6.0, "lever": 0.1, "valve": 1e-4, "W": 7.7366, "g": 9.81}


def mechanism(**changed: float) -> fb.Mechanism:
    """The governor in steady motion, as drawn; parameters may have other values."""
    m = fb.Mechanism("Watt's governor", gravity=(0, 0, "-g"), parameters=P | changed)
    foot, turning = (0, 0, "-2*l*cos(alpha)"), {"angular_velocity": (0, 0, "W")}
    wheel = fb.Cylinder(radius=0.2, length=0.04, position=(0, 0, 0.12), looks=True)
    shaft = fb.Rod(start=(0, 0, -0.6), end=(0, 0, 0.14), radius=0.01, looks=True)
    collar = fb.Tube(radius=0.03, inner_radius=0.012, length=0.05, looks=True)
    m.add(fb.Body("engine", mass=1, inertia=("J", "J", "J"), shape=[wheel, shaft], color="#5b6770", **turning))
    m.add(fb.Body("sleeve", mass="sleeve", inertia=(0, 0, 0), position=foot, shape=collar, color="#c08a3e", **turning))
    m.add(fb.Revolute("shaft", "ground", "engine", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Prismatic("guide", "engine", "sleeve", at=foot, axis=(0, 0, 1)))
    for side, name in ((1, "right"), (-1, "left")):
        at = (f"{side}*l*sin(alpha)", 0, "-l*cos(alpha)")
        moving = {"velocity": (0, f"{side}*W*l*sin(alpha)", 0), **turning}
        hung = [
            fb.Sphere(radius=0.05, looks=True),
            fb.Rod(start=(0, 0, 0), end=(f"-{side}*l*sin(alpha)", 0, "l*cos(alpha)"), radius=0.008, looks=True),
        ]
        m.add(fb.Body(name, mass="m", inertia=("I", "I", "I"), position=at, shape=hung, color="#a63d2f", **moving))
        m.add(fb.Revolute(f"{name} hinge", "engine", name, at=(0, 0, 0), axis=(0, -side, 0)))
        m.add(fb.Distance(f"{name} link", name, "sleeve", at=(at, foot)))
    m.add(fb.CoordinateSpring("dashpot", "guide.displacement", damping="b"))
    _add_engine(m)
    return m


def _add_engine(m: fb.Mechanism) -> None:
    """Add the throttle valve in its pipe, turned by the sleeve, the engine's torque, and the load."""
    at = (0.45, 0, -0.45)
    across = {"orientation": (0, "90 deg", 0), "looks": True}
    disk = [
        fb.Cylinder(radius=0.056, length=0.006, orientation=(0, "45 deg", 0), looks=True),
        fb.Rod(start=(0, -0.09, 0), end=(0, 0.09, 0), radius=0.006, looks=True),
        fb.Rod(start=(0, -0.09, 0), end=(-0.1, -0.09, 0), radius=0.006, looks=True),
    ]
    pipe = [fb.Tube(radius=0.065, inner_radius=0.058, length=0.12, position=(x, 0, 0), **across) for x in (-0.12, 0.12)]
    m.add(fb.Ground("steam pipe", shape=pipe, position=at, color="#9aa6b3"))
    m.add(fb.Body("valve", mass=0.1, inertia=("valve",) * 3, position=at, shape=disk, color="#2f6fb7"))
    m.add(fb.Revolute("spindle", "ground", "valve", at=at, axis=(0, 1, 0)))
    m.add(fb.Coupler("rod", ["guide.displacement", "spindle.angle"], weights=[1, "-lever"]))
    m.add(fb.Sensor("turned", "spindle.angle"))
    m.add(fb.Motor("steam", joint="shaft", torque="load*(1 - tanh(k*lever*turned/load))"))
    m.add(fb.Motor("driven machine", joint="shaft", torque="-load"))


def main(out: Path) -> None:
    """Print the criterion, and its limit for point balls on a heavy engine: b J / m > 2 F / W in Pontryagin's terms."""
    import sympy

    found = mechanism().symbolic().linear(balanced_by=["g"]).routh()
    print(found)
    (condition,) = found.conditions
    x = {s.name: s for s in condition.free_symbols}
    heavy = sympy.Symbol("heavy", positive=True)
    own = {x["I"]: 0, x["sleeve"]: 0, x["valve"]: 0, x["J"]: heavy * x["J"], x["k"]: heavy * x["k"]}
    limit = [sympy.limit(sympy.expand(side.subs(own)) / heavy, heavy, sympy.oo) for side in condition.args]
    print("point balls, no sleeve, a heavy engine:", sympy.Gt(*limit))
    out.mkdir(parents=True, exist_ok=True)
    run = mechanism(b=4.0, W=7.8).simulate(60, outputs=2401)  # a little too fast at the start
    run.plot("shaft.angle_rate", "guide.displacement", path=out / "governor_limit_cycle.png")
    run.to_html(out / "governor_limit_cycle.html")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
