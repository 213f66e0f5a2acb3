"""Mechanisms whose joints are given by frames, drawn roughly."""

import numpy as np

import flyball as fb


def framed(model, kind, name, i, p, j, q, turn_i=None, turn_j=None):
    """A joint between a frame at p on body i and a frame at q on body j."""
    for role, body, at, turn in (("F", i, p, turn_i), ("M", j, q, turn_j)):
        more = {} if turn is None else {"orientation": turn}
        model.add(fb.Frame(f"{name} {role}", body, position=at, **more))
    model.add(kind(name, f"{name} F", f"{name} M"))


def rough_four_bar(spread=0.3, seed=0):
    """The planar four-bar by lengths only, every body thrown somewhere."""
    m = fb.Mechanism("rough four-bar", planar=True)
    random = np.random.default_rng(seed)
    for name, length in (("crank", 0.2), ("coupler", 0.5), ("rocker", 0.4)):
        p = random.normal(size=2) * spread
        m.add(fb.Body(name, mass=1, inertia=length**2 / 12, position=p, angle=random.uniform(-np.pi, np.pi)))
    framed(m, fb.Revolute, "A", "ground", (0, 0), "crank", (-0.1, 0))
    framed(m, fb.Revolute, "B", "crank", (0.1, 0), "coupler", (-0.25, 0))
    framed(m, fb.Revolute, "C", "coupler", (0.25, 0), "rocker", (0.2, 0))
    framed(m, fb.Revolute, "D", "ground", (0.5, 0), "rocker", (-0.2, 0))
    return m
