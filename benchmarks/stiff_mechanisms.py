"""Stiff mechanisms as numbers, with motions that are known: a body in a mount, a pendulum in honey, a stiff coupler."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from trees import Array, Axis, Link, Tree

from mechanisms import GRAVITY, GROUND, Planar

X, Y, Z = np.eye(3)
MASS, STIFFNESS, SPEED = 1e-3, 1e6, 3.0  # of the body in a mount
HONEY = 1e4  # damping of the pendulum's hinge [N m s/rad]
COUPLER = 1e8  # stiffness of the four-bar's coupler [N/m]


def mounted_body(damping: float) -> Tree:
    """A body of 1 g in a mount of 1e6 N/m, pushed along x."""
    slides = [Axis("slide", 0 * X, d, STIFFNESS, 0.0, damping) for d in (X, Y, Z)]
    hinges = [Axis("hinge", 0 * X, d, 100.0, 0.0, 1e-3) for d in (X, Y, Z)]
    link = Link("body", MASS, 1e-7 * np.eye(3), 0 * X, GROUND, (*slides, *hinges))
    return Tree("mount", 0 * X, (link,), (), np.array([SPEED, 0, 0, 0, 0, 0]))


def mounted_exact(damping: float, t: Array) -> Array:
    """Its displacement."""
    a, b = np.roots([MASS, damping, STIFFNESS]).astype(complex)
    return (SPEED / (a - b) * (np.exp(a * t) - np.exp(b * t))).real


def pendulum_in_honey() -> Tree:
    """A pendulum of 1 m whose hinge is so damped that it creeps."""
    hinge = Axis("hinge", 0 * X, Z, 0.0, 0.0, HONEY)
    link = Link("bob", 1.0, 1e-2 * np.eye(3), X, GROUND, (hinge,))
    return Tree("honey", np.array([0.0, -GRAVITY, 0.0]), (link,), (), np.zeros(1))


def honey_exact(t: Array) -> Array:
    """Position of its bob, (times, 2): by SciPy's Radau on the equation of its angle."""
    s = solve_ivp(
        lambda _, y: [y[1], (-GRAVITY * np.cos(y[0]) - HONEY * y[1]) / 1.01], (0.0, t[-1]), [0.0, 0.0], "Radau", t,
        rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    return np.column_stack([np.cos(s.y[0]), np.sin(s.y[0])])


def stiff_coupler() -> Planar:
    """A four-bar whose coupler is a spring of 1e8 N/m: a crank of 1 m, a rocker of 1.5 m, 2 m apart."""
    start = np.array([(0.0, 0.5, np.pi / 2), (2.0, 0.25, np.pi / 2)])
    rate = np.array([(0.5, 0.0, -1.0), (0.5, 0.0, -2.0 / 3.0)])
    hinges = ((GROUND, (0.0, 0.0), 0, (-0.5, 0.0)), (GROUND, (2.0, -0.5), 1, (-0.75, 0.0)))
    springs = ((0, (0.5, 0.0), 1, (0.75, 0.0), COUPLER, 2.0),)
    mass, inertia = np.array([1.0, 1.0]), np.array([1.0, 1.5**2]) / 12.0
    return replace(Planar("coupler", mass, inertia, start, rate, hinges), springs=springs)
