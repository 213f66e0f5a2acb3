"""A cart swings its pole up with as little force as it can: found by CasADi and Ipopt, shown by flyball.

flyball describes the mechanism and exports its right-hand side as a CasADi function; direct collocation (Gauss-Legendre
points of degree 4, the force a straight line between the nodes) finds the motion with the least integral of the force
squared; flyball then simulates the mechanism with that force as a table. Data after M. Kelly, *An introduction to
trajectory optimization*, SIAM Review 59 (2017), section 6: bob of 0.3 kg at 0.5 m, cart of 1 kg, 2 s, 1 m, 20 N.

Run it with ``python examples/cart_pole_swing_up.py out``: it writes plots and a page with the animation into the
folder. It needs the package casadi (``pip install "flyball[casadi]"``).
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

CART, BOB, LENGTH = 1.0, 0.3, 0.5  # kg, kg, m
SECONDS, WAY, FORCE, RAIL = 2.0, 1.0, 20.0, 2.0  # s, m, N, m
ROCKING = [0.0, 6.0, -6.0, -6.0, 6.0, 0.0]  # N: a force to look at while none is found


def mechanism(forces: list[float] = ROCKING, seconds: float = SECONDS) -> fb.Mechanism:
    """Cart and pole, hanging; the force on the cart goes through these values at equal times."""
    times = np.linspace(0, seconds, len(forces))
    m = fb.Mechanism("cart and pole", planar=True, gravity=(0, -9.81))
    m.add(
        fb.Body("cart", mass=CART, inertia=0.01, shape=fb.Box(edges=(0.2, 0.08, 0.1)), color="#5b6770"),
        fb.Body(
            "pole",
            mass=BOB,
            inertia=0,  # a bob on a rod without mass
            position=(0, -LENGTH),
            shape=(
                fb.Cylinder(radius=0.03, length=0.04),
                fb.Box(edges=(0.012, LENGTH, 0.012), position=(0, LENGTH / 2, 0)),
            ),
            color="#c08a3e",
        ),
        fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)),
        fb.Revolute("pin", "cart", "pole", at=(0, 0)),
        fb.Table("force", x=times, y=forces, interpolation="linear", beyond="hold"),
        fb.Actuator("push", "rail.displacement", force="force(t)"),
    )
    return m


def swing_up(intervals: int = 60, degree: int = 4) -> list[float]:
    """The force at the nodes."""
    import casadi as ca

    code = mechanism([0.0, 0.0]).export(language="casadi", inputs=["push"], functions=["right_hand_side"])
    assert code.names["q"] == ("rail.displacement", "pin.angle")
    opti, h = ca.Opti(), SECONDS / intervals
    x, u = opti.variable(4, intervals + 1), opti.variable(intervals + 1)
    tau = ca.collocation_points(degree, "legendre")
    slopes, ends, _ = ca.collocation_coeff(tau)
    for k in range(intervals):
        inner = opti.variable(4, degree)
        through = ca.horzcat(x[:, k], inner)
        for j in range(degree):
            force = u[k] + tau[j] * (u[k + 1] - u[k])
            qdot, vdot, _ = code["right_hand_side"](0.0, inner[:2, j], inner[2:, j], force)
            opti.subject_to(through @ slopes[:, j] == h * ca.vertcat(qdot, vdot))
            opti.set_initial(inner[:, j], ca.DM([WAY, np.pi, 0, 0]) * (k + tau[j]) / intervals)
        opti.subject_to(x[:, k + 1] == through @ ends)
    opti.subject_to([x[:, 0] == 0, x[:, -1] == ca.DM([WAY, np.pi, 0, 0])])
    opti.subject_to([opti.bounded(-FORCE, u, FORCE), opti.bounded(-RAIL, x[0, :], RAIL)])
    opti.set_initial(x, ca.DM([WAY, np.pi, 0, 0]) @ ca.DM(np.linspace(0, 1, intervals + 1)).T)
    opti.minimize(h / 3 * ca.sum1(u[:-1] ** 2 + u[:-1] * u[1:] + u[1:] ** 2))
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    return opti.solve().value(u).tolist()


def shown(forces: list[float]) -> fb.Result:
    """The motion with that force, as flyball computes it."""
    return mechanism(forces).simulate(SECONDS, rtol=1e-9)


if __name__ == "__main__":
    found = swing_up()
    run = shown(found)
    print(
        f"largest force {max(map(abs, found)):.2f} N of {FORCE:g} N allowed, cart between "
        f"{run['rail.displacement'].min():.3f} and {run['rail.displacement'].max():.3f} m"
    )
    print(
        f"pole at the end {np.degrees(run['pin.angle'][-1]):.6f} degrees, cart at {run['rail.displacement'][-1]:.6f} m"
    )
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        run.plot("rail.displacement", "pin.angle", "push.force", path=folder / "swing_up.png")
        run.to_html(folder / "swing_up.html")
