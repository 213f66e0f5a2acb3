"""A pole that stands on a cart, held upright by a state feedback: linearised, LQR, simulated, sampled too.

flyball linearises the mechanism about the upright position, the python-control library finds the gains that are best
for a quadratic cost (LQR), and these stand in the mechanism as a controller: a `StateSpace` without states of its own,
and one that looks every 20 ms, with the gains of the sampled plant. Data: cart 0.5 kg, pole 0.2 kg with its mass centre
at 0.3 m, as of the "Inverted Pendulum" of Control Tutorials for MATLAB and Simulink (University of Michigan).

Run it with ``python examples/inverted_pendulum.py out``: it prints the poles and writes plots and a page with the
animation into the folder. It needs the package control (``pip install "flyball[control]"``).
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

CART, POLE, INERTIA, ARM, DAMPING = 0.5, 0.2, 0.006, 0.3, 0.1  # kg, kg, kg m^2, m, N s/m
COST, EFFORT = np.diag([5000.0, 100.0, 0.0, 0.0]), [[1.0]]  # of place and angle, of the force
PERIOD = 0.02  # s
STATES = ("rail.displacement", "pin.angle", "rail.displacement_rate", "pin.angle_rate")


def mechanism(tilt: str | float = 0.0) -> fb.Mechanism:
    """Cart and pole, standing; nothing holds it."""
    m = fb.Mechanism("inverted pendulum", planar=True, gravity=(0, -9.8))
    m.add(
        fb.Body("cart", mass=CART, inertia=0.01, shape=fb.Box(edges=(0.2, 0.08, 0.1)), color="#5b6770"),
        fb.Body("pole", mass=POLE, inertia=INERTIA, position=(0, ARM), shape=fb.Box(edges=(0.02, 2 * ARM, 0.02))),
        fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)),
        fb.Revolute("pin", "cart", "pole", at=(0, 0)),
        fb.CoordinateSpring("drag", "rail.displacement", damping=DAMPING),
        fb.Initial("rail.displacement", value=0.0),
        fb.Initial("pin.angle", value=tilt),
        fb.Actuator("push", "rail.displacement", force=0.0),
    )
    return m


def plant() -> fb.LinearModel:
    """Force to the four states, about the upright position."""
    return mechanism().linearize(["push"], STATES)


def gains(period: float | None = None) -> np.ndarray:
    """The best gains, (1, 4); of the sampled plant with a period."""
    import control as ct

    lin = plant()
    assert np.allclose(lin.C, np.eye(4))  # the states are the four
    if period is None:
        return ct.lqr(lin.A, lin.B, COST, EFFORT)[0]
    sampled = ct.sample_system(lin.to_control(), period)
    return ct.dlqr(sampled.A, sampled.B, COST, EFFORT)[0]


def held(tilt: str | float = "10 deg", period: float | None = None) -> fb.Mechanism:
    """The mechanism with the feedback u = -K x."""
    m = mechanism(tilt)
    m.add(fb.StateSpace("feedback", inputs=STATES, D=-gains(period), period=period))
    m.replace(fb.Actuator("push", "rail.displacement", force="feedback"))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    print("without feedback", plant().eigenvalues)
    print("with feedback   ", held(0.0).linearize().eigenvalues)
    for name, period in (("continuous", None), ("sampled", PERIOD)):
        run = held(period=period).simulate(4, outputs=401)
        run.plot("pin.angle", "rail.displacement", "feedback.output", path=folder / f"inverted_pendulum_{name}.png")
        run.to_html(folder / f"inverted_pendulum_{name}.html")
