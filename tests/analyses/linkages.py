"""Mechanisms of these tests, drawn closed."""

from __future__ import annotations

import numpy as np

import flyball as fb
from tests.mechanisms import circles, planar_rod


def bennett(a: float = 1.0, b: float = 0.8, alpha: float = 0.6, theta: float = 0.9) -> fb.Mechanism:
    """Bennett's mechanism (1903): sin(alpha) / a = sin(beta) / b, opposite links alike; link 0 is ground.

    Denavit and Hartenberg's frames, with tan(theta1 / 2) tan(theta2 / 2) = sin((beta + alpha) / 2) / sin((beta - alpha) / 2).
    """
    beta = np.arcsin(np.sin(alpha) * b / a)
    k = np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2)
    other = 2 * np.arctan(k / np.tan(theta / 2))
    T, frames = np.eye(4), []
    for length, twist, angle in zip((a, b, a, b), (alpha, beta, alpha, beta), (theta, other, -theta, -other)):
        frames.append(T)
        c, s, d, e = np.cos(angle), np.sin(angle), np.cos(twist), np.sin(twist)
        turn = np.array([[c, -s * d, s * e, length * c], [s, c * d, -c * e, length * s], [0, e, d, 0], [0, 0, 0, 1]])
        T = T @ turn
    assert np.allclose(T, np.eye(4))
    m = fb.Mechanism("Bennett")
    names = ["ground", "link 1", "link 2", "link 3"]
    P, Z = [f[:3, 3] for f in frames], [f[:3, 2] for f in frames]
    for i in (1, 2, 3):
        m.add(fb.Body(names[i], mass=1, inertia=(0.1, 0.1, 0.1), position=(P[i] + P[(i + 1) % 4]) / 2))
    for i in range(4):
        m.add(fb.Revolute(f"R{i + 1}", names[i - 1], names[i], at=P[i], axis=Z[i]))
    return m


def slider_crank(law: str = "5*t", r: float = 0.2, l: float = 0.5, start: float = 0.0, g: float = 0.0, on="crank"):
    """Crank r about the origin, rod l, slider on the x axis; drawn at the crank angle ``start``; masses 1, 2, 3 kg."""
    A = r * np.array([np.cos(start), np.sin(start)])
    B = np.array([A[0] + np.sqrt(l * l - A[1] ** 2), 0.0])
    m = fb.Mechanism("slider-crank", planar=True, gravity=(0, -g))
    m.add(planar_rod("crank", (0, 0), A, 1.0), planar_rod("rod", A, B, 2.0))
    m.add(fb.Body("slider", mass=3.0, inertia=0.01, position=B))
    m.add(fb.Revolute("O", "ground", "crank", at=(0, 0), angle=start), fb.Revolute("A", "crank", "rod", at=A))
    m.add(fb.Revolute("B", "rod", "slider", at=B))
    m.add(fb.Translational("guide", "ground", "slider", at=B, axis=(1, 0), displacement=B[0]))
    m.add(fb.Driver("drive", {"crank": "O.angle", "slider": "slider.x"}[on], law))
    return m


def whitworth(law: str = "4*t", r: float = 0.1, d: float = 0.3, start: float = 0.5) -> fb.Mechanism:
    """Whitworth's quick return: a crank r about (0, d), whose pin slides in a lever about the origin."""
    P = np.array([r * np.cos(start), d + r * np.sin(start)])
    m = fb.Mechanism("quick return", planar=True)
    m.add(planar_rod("crank", (0, d), P), planar_rod("lever", (0, 0), 1.5 * P))
    m.add(fb.Body("block", mass=0.1, inertia=1e-4, position=P, angle=float(np.arctan2(P[1], P[0]))))
    m.add(fb.Revolute("C", "ground", "crank", at=(0, d), angle=start), fb.Revolute("O", "ground", "lever", at=(0, 0)))
    m.add(fb.Revolute("pin", "crank", "block", at=P), fb.Translational("slot", "lever", "block", at=P, axis=P))
    m.add(fb.Driver("drive", "C.angle", law))
    return m


def four_bar_driven(law: str = "1 + 6*t", ground=0.5, crank=0.2, coupler=0.5, rocker=0.4, g: float = 9.81, space=False):
    """A crank-rocker in the plane, or the same of four hinges in space; the crank is drawn at 1 rad."""
    a, d = np.zeros(2), np.array([ground, 0.0])
    b = crank * np.array([np.cos(1.0), np.sin(1.0)])
    c = circles(b, coupler, d, rocker)
    m = fb.Mechanism("four-bar", planar=not space, gravity=(0, -g, 0) if space else (0, -g))
    for name, p, q, mass in (("crank", a, b, 1.0), ("coupler", b, c, 1.5), ("rocker", d, c, 0.8)):
        flat = planar_rod(name, p, q, mass)
        if space:
            flat = fb.Body(name, mass=mass, inertia=(1e-4, flat.inertia, flat.inertia), position=(*flat.position, 0),
                           orientation=(0, 0, flat.angle))  # fmt: skip
        m.add(flat)
    for name, i, j, at in (("A", "ground", "crank", a), ("B", "crank", "coupler", b), ("C", "coupler", "rocker", c),
                           ("D", "ground", "rocker", d)):  # fmt: skip
        more = {"axis": (0, 0, 1)} if space else {}
        m.add(fb.Revolute(name, i, j, at=(*at, 0) if space else at, angle=1.0 if name == "A" else 0.0, **more))
    m.add(fb.Driver("motor", "A.angle", law))
    return m
