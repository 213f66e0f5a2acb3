"""Mechanisms with closed forms that several tests ask something of."""

from __future__ import annotations

import numpy as np

import flyball as fb

G = 9.81


def rod(angle: float = 0.0, **parameters: float) -> fb.Mechanism:
    """A uniform rod of 1 m and 1 kg on a hinge, its angle from hanging."""
    m = fb.Mechanism("rod", planar=True, gravity=(0, -G), parameters=parameters)
    at = (0.5 * np.sin(angle), -0.5 * np.cos(angle))
    m.add(fb.Body("rod", mass=1, inertia=1 / 12, position=at, angle=angle))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0), angle=angle))
    return m


def chain(n: int, angle: float = 0.0) -> fb.Mechanism:
    """n uniform rods of 1/n m and 1/n kg in a row."""
    m = fb.Mechanism("chain", planar=True, gravity=(0, -G))
    way = np.array([np.sin(angle), -np.cos(angle)]) / n
    before = "ground"
    for k in range(n):
        m.add(fb.Body(f"rod {k}", mass=1 / n, inertia=n**-3 / 12, position=tuple((k + 0.5) * way), angle=angle))
        m.add(fb.Revolute(f"J{k}", before, f"rod {k}", at=tuple(k * way)))
        before = f"rod {k}"
    return m


def chain_matrices(n: int) -> tuple[np.ndarray, np.ndarray]:
    """(M, K) of the hanging chain in its rods' angles, by Lagrange's equations."""
    m = length = 1 / n
    k = np.arange(n)
    beyond = n - 1 - np.maximum(k[:, None], k[None, :])
    M = m * length**2 * (beyond + 0.5)
    M[k, k] = m * length**2 * (n - 1 - k + 1 / 3)
    return M, np.diag(m * G * length * (n - 1 - k + 0.5))


def parallelogram(angle: float = 0.0, cranks: int = 2) -> fb.Mechanism:
    """Cranks of 1 m and 1 kg that carry a coupler of 1 m and 1 kg, swung by an angle from hanging."""
    m = fb.Mechanism("parallelogram", planar=True, gravity=(0, -G))
    d = np.array([np.sin(angle), -np.cos(angle)])
    feet = [np.array([x, 0.0]) for x in np.linspace(0, 1, cranks)]
    m.add(fb.Body("coupler", mass=1, inertia=1 / 12, position=tuple(np.array([0.5, 0]) + d)))
    for k, foot in enumerate(feet):
        m.add(fb.Body(f"crank {k}", mass=1, inertia=1 / 12, position=tuple(foot + d / 2), angle=angle))
        m.add(fb.Revolute(f"A{k}", "ground", f"crank {k}", at=tuple(foot)))
        m.add(fb.Revolute(f"B{k}", f"crank {k}", "coupler", at=tuple(foot + d)))
    return m


def conical_pendulum(tilt: float = 1.0) -> fb.Mechanism:
    """A point mass at 1 m from a hinge on a fork that turns about the vertical at the speed that keeps it up."""
    speed = np.sqrt(G / np.cos(tilt))
    at = np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
    m = fb.Mechanism("conical pendulum", gravity=(0, 0, -G))
    m.add(fb.Body("fork", mass=1e-3, inertia=(1e-12,) * 3, angular_velocity=(0, 0, speed)))
    m.add(
        fb.Body(
            "bob", mass=1, inertia=(1e-12,) * 3, position=tuple(at),
            velocity=(0, speed * at[0], 0), angular_velocity=(0, 0, speed),
        )
    )  # fmt: skip
    m.add(fb.Revolute("vertical", "ground", "fork", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Revolute("hinge", "fork", "bob", at=(0, 0, 0), axis=(0, 1, 0)))
    return m


def watt(damping: float, off: float = 0.0) -> tuple[fb.Mechanism, dict[str, float]]:
    """Watt's governor on an engine whose torque falls as the arms rise; the arms drawn ``off`` their steady angle."""
    p = {"length": 0.5, "ball": 1.0, "engine": 0.8, "torque": 8.0, "set": 0.6}
    angle, length = p["set"] + off, p["length"]
    speed = p["speed"] = np.sqrt(G / (length * np.cos(p["set"])))
    m = fb.Mechanism("Watt", gravity=(0, 0, -G), parameters={"damping": damping})
    m.add(fb.Body("engine", mass=1, inertia=(p["engine"],) * 3, angular_velocity=(0, 0, speed)))
    m.add(fb.Revolute("shaft", "ground", "engine", at=(0, 0, 0), axis=(0, 0, 1)))
    for side, name in ((1, "left"), (-1, "right")):
        at = (side * length * np.sin(angle), 0, -length * np.cos(angle))
        moving = {"velocity": (0, speed * at[0], 0), "angular_velocity": (0, 0, speed)}
        m.add(fb.Body(name, mass=p["ball"], inertia=(1e-9,) * 3, position=at, **moving))
        m.add(fb.Revolute(f"{name} hinge", "engine", name, at=(0, 0, 0), axis=(0, -side, 0), angle=angle))
        m.add(fb.TorsionalSpringDamper(f"{name} damper", joint=f"{name} hinge", damping="damping"))
    m.add(fb.Sensor("lift", "left hinge.angle"))
    m.add(fb.Motor("steam", joint="shaft", torque=f"{p['torque']}*(cos(lift) - cos({p['set']}))"))
    return m, p
