"""Mechanisms whose lists, names and numbers are changed in place answer as mechanisms that were written so."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

import flyball as fb


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"L": 1.0})
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(0.5, 0)), fb.Frame("tip", "rod", position=("L/2", 0)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.SpringDamper("spring", "ground", "tip", stiffness=10, length=0.5))
    return m


def acceleration(m: fb.Mechanism) -> float:
    return float(m.simulate(0.01, outputs=2)["A"].angle_acceleration[0])


@pytest.mark.parametrize("kind", [list, np.array])
def test_gravity_that_is_changed_in_place(kind):
    m = pendulum()
    m.forces.clear()
    given = kind([0.0, -1.0])
    m.gravity = given
    assert acceleration(m) == pytest.approx(-1.0 * 0.5 / 0.35)  # m g l / (I + m l^2)
    given[1] = -2.0  # another vector than the mechanism's own
    assert acceleration(m) == acceleration(deepcopy(m)) == pytest.approx(-1.0 * 0.5 / 0.35)
    other = m.copy()
    m.gravity[1] = -3.0
    assert acceleration(m) == pytest.approx(-3.0 * 0.5 / 0.35)
    assert acceleration(other) == pytest.approx(-1.0 * 0.5 / 0.35)
    with pytest.raises(fb.ModelError, match="gravity of 'pendulum' is a vector"):
        m.gravity = 9.81


def test_values_of_another_kind_are_looked_at_again():
    m = pendulum()
    wanted = acceleration(m)
    m.parameters["L"] = True
    with pytest.raises(fb.ModelError, match="true or false"):
        m.simulate(0.01)
    m.parameters["L"] = 1
    assert acceleration(m) == wanted


def test_lists_that_no_longer_fit_are_told():
    m = pendulum()
    acceleration(m)
    m.frames.clear()
    with pytest.raises(fb.ModelError, match="SpringDamper 'spring': body_j: there is no body or frame named 'tip'"):
        m.simulate(0.01)
    m = pendulum()
    m.bodies.append(replace(m.bodies[0], mass=3))
    with pytest.raises(fb.ModelError, match="two parts named 'rod'"):
        m.simulate(0.01)
    m = pendulum()
    m.joints.append(m.bodies[0])
    with pytest.raises(fb.ModelError, match="joints of 'pendulum' contain something else"):
        m.simulate(0.01)


def test_a_part_put_into_a_list_is_the_one_that_counts():
    m = pendulum()
    m.frames[0] = replace(m.frames[0], position=(0.0, 0.2))
    other = pendulum()
    other.replace(m.frames[0])
    assert acceleration(m) == acceleration(other)
    assert m.snapshot()["tip"] is m.frames[0]
    m.bodies[0] = replace(m.bodies[0], name="bar")
    with pytest.raises(fb.ModelError, match="named 'rod'"):
        m.simulate(0.01)
