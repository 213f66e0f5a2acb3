"""Watt's governor on its engine: Vyshnegradskii's criterion of stability as a formula, from the mechanism itself.

Balls of mass ``m`` (moment of inertia ``I`` about their own centres) on arms of length ``l`` at ``alpha`` from the
vertical lift a sleeve by links of the same length; all turn with the shaft of an engine (inertia ``J``) at ``W``. Where
the sleeve rises by a metre the torque falls by ``k``; a dashpot ``b`` damps the sleeve.

Run it with ``python examples/governor_criterion.py``: it needs ``pip install 'flyball[symbolic]'``.
"""

import flyball as fb


def mechanism(**changed: float) -> fb.Mechanism:
    """The governor in steady motion, as drawn; parameters may have other values."""
    p = {"m": 1.0, "I": 0.01, "sleeve": 0.4, "l": 0.3, "alpha": 0.7, "J": 2.0, "k": 5.0, "b": 20.0}
    m = fb.Mechanism("Watt's governor", gravity=(0, 0, "-g"), parameters=p | {"W": 7.7366, "g": 9.81} | changed)
    foot, turning = (0, 0, "-2*l*cos(alpha)"), {"angular_velocity": (0, 0, "W")}
    m.add(fb.Body("engine", mass=1, inertia=("J", "J", "J"), **turning))
    m.add(fb.Body("sleeve", mass="sleeve", inertia=(0, 0, 0), position=foot, **turning))
    m.add(fb.Revolute("shaft", "ground", "engine", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Prismatic("guide", "engine", "sleeve", at=foot, axis=(0, 0, 1)))
    for side, name in ((1, "right"), (-1, "left")):
        at = (f"{side}*l*sin(alpha)", 0, "-l*cos(alpha)")
        moving = {"velocity": (0, f"{side}*W*l*sin(alpha)", 0), **turning}
        m.add(fb.Body(name, mass="m", inertia=("I", "I", "I"), position=at, **moving))
        m.add(fb.Revolute(f"{name} hinge", "engine", name, at=(0, 0, 0), axis=(0, -side, 0)))
        m.add(fb.Distance(f"{name} link", name, "sleeve", at=(at, foot)))
    m.add(fb.CoordinateSpring("dashpot", "guide.displacement", damping="b"))
    m.add(fb.Sensor("rise", "guide.displacement"))
    m.add(fb.Motor("steam", joint="shaft", torque="-k*rise"))
    return m


def main() -> None:
    """Print the criterion, and its limit for point balls on a heavy engine: b J / m > 2 F / W in Pontryagin's terms."""
    import sympy

    found = mechanism().symbolic().linear(balanced_by=["g"]).routh()
    print(found)
    (condition,) = found.conditions
    x = {s.name: s for s in condition.free_symbols}
    heavy = sympy.Symbol("heavy", positive=True)
    own = {x["I"]: 0, x["sleeve"]: 0, x["J"]: heavy * x["J"], x["k"]: heavy * x["k"]}
    limit = [sympy.limit(sympy.expand(side.subs(own)) / heavy, heavy, sympy.oo) for side in condition.args]
    print("point balls, no sleeve, a heavy engine:", sympy.Gt(*limit))


if __name__ == "__main__":
    main()
