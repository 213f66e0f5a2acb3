"""Every argument of every analysis given what it cannot be: an error of our own, before anything is computed."""

from __future__ import annotations

import inspect
import math

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
