"""Every argument of every analysis given what it cannot be: an error of our own, before anything is computed."""

from __future__ import annotations

import contextlib
import inspect
import math

import numpy as np
import pytest

import flyball as fb

ASKED = {
    "simulate": (0.01,),
    "compare": (0.01,),
    "kinematics": (3,),
    "inverse_dynamics": (3,),
    "equilibrium": (),
    "equilibria": ("k", [1, 2]),
    "linearize": (),
    "modes": (),
    "root_locus": ("k", [1, 2]),
    "sensitivity": (["b.x"], ["k"]),
    "optimize": (["b.x"], {"k": (0.5, 2)}),
    "mobility": (),
    "mass_properties": (),
    "singularities": ("D", (0, 1)),
    "assemble": (),
}
ARGUMENTS = [
    (name, p)
    for name in ASKED
    for p in inspect.signature(getattr(fb.Mechanism, name)).parameters
    if p not in ("self", "options")
]


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"k": 1.0})
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(0, -1)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Motor("M", "A", torque="0*k"), fb.Driver("D", "A.angle", "t"))
    return m


@pytest.mark.parametrize(("analysis", "argument"), ARGUMENTS)
@pytest.mark.parametrize("wrong", [object(), 1j, math.nan], ids=["object", "complex", "nan"])
def test_a_wrong_argument_is_refused(analysis, argument, wrong):
    method = getattr(pendulum(), analysis)
    names = [p for p in inspect.signature(method).parameters]
    given = dict(zip(names, ASKED[analysis], strict=False)) | {argument: wrong}
    if analysis in ("kinematics", "inverse_dynamics"):
        given = {"t_end": 0.1} | given
    with pytest.raises(fb.FlyballError):
        method(**given)


STRANGE = {
    "huge": 10**29,
    "without end": 10**400,
    "array": np.array([1.0, 2.0]),
    "lists": [[1, 2], [3]],
    "empty": [],
    "numbered": {1: 2},
    "type": int,
    "half a letter": "\ud800",
    "bytes": b"x",
}


@pytest.mark.parametrize(("analysis", "argument"), [a for a in ARGUMENTS if a[1] not in ("progress", "checkpoint")])
def test_nothing_strange_ends_in_an_error_of_somebody_else(analysis, argument):
    """Lists as names, whole numbers that no float holds, arrays that are neither true nor false: refused or done."""
    method = getattr(pendulum(), analysis)
    names = [p for p in inspect.signature(method).parameters]
    given = dict(zip(names, ASKED[analysis], strict=False))
    if analysis in ("kinematics", "inverse_dynamics"):
        given |= {"t_end": 0.1}
    for strange in STRANGE.values():
        with contextlib.suppress(fb.FlyballError):
            method(**given | {argument: strange})


def test_a_material_of_many_bodies_that_is_not_there_is_refused():
    m = fb.Mechanism("pile")
    with pytest.raises(fb.ModelError, match="Bodies 's': material: there is no material named 'nope'"):
        m.add(
            fb.Bodies("s", shape=fb.Sphere(radius=0.1), position=[[0, 0, 1], [0, 0, 2]], density=1e3, material="nope")
        )


def test_counts_that_are_too_large_and_lists_of_methods_are_refused():
    with pytest.raises(fb.ModelError, match="max_steps must be at most 9223372036854775807, got 10000"):
        pendulum().simulate(0.01, max_steps=10**29)
    with pytest.raises(fb.ModelError, match=r"unknown method \['rk45'\]; choose one of"):
        pendulum().simulate(0.01, method=["rk45"])
    with pytest.raises(fb.ModelError, match=r"1000000000\.\.\. \(401 digits\) is too large"):
        pendulum().simulate(10**400)
