"""Fixed steps that turn a body too far for their method: its angle is off as told, and the balance says nothing."""

import re

import numpy as np
import pytest

import flyball as fb

W = 100.0  # rad/s
LAST = 5.0  # s


def wheel(w=W):
    m = fb.Mechanism("wheel", gravity=(0, 0, 0), parameters={"w": w})
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1), angular_velocity=(0, 0, "w")))
    m.add(fb.Revolute("R", "ground", "b", at=(0, 0, 0), axis=(0, 0, 1)))
    return m


def turned(method, step, **more):
    return wheel().simulate(LAST, outputs=51, method=method, step=step, specialize=False, **more)


@pytest.mark.parametrize(
    ("method", "step"),
    [("rk45", 0.025), ("rk45", 0.03125), ("rk45", 0.04), ("dop853", 0.0625), ("radau", 0.0125), ("radau", 0.01)],
)
def test_what_is_told_is_what_the_angle_is_off_by(method, step):
    r = turned(method, step, coordinates="absolute")
    off = abs(r["R.angle"][-1] - W * LAST)
    assert np.abs(r.energy.balance).max() < 1e-6 * r.energy.kinetic[0]
    (text,) = r.health.doubtful
    assert r.health.status == "done, but doubtful"
    assert text.startswith(f"'b' turns by up to {W * step:.2g} rad per step. The error of method={method!r}")
    assert float(re.search(r"wrong by about (\S+) rad", text)[1]) == pytest.approx(off, rel=0.05)  # two digits


@pytest.mark.parametrize(
    ("method", "step", "coordinates"),
    [
        ("rk45", 0.02, "absolute"),
        ("dop853", 0.03125, "absolute"),
        ("radau", 0.005, "absolute"),
        ("variational", 0.03125, "absolute"),
        ("generalised-alpha", 0.0125, "absolute"),
        ("rk45", 0.03125, "joint"),  # where the angle is a coordinate
        ("dop853", None, "absolute"),
    ],
)
def test_what_turns_as_it_should_is_not_doubted(method, step, coordinates):
    r = turned(method, step, coordinates=coordinates)
    assert np.abs(r["R.angle"] - W * r.t).max() < 0.01
    assert not r.health.doubtful


def test_of_many_motions_those_are_doubtful_that_are_by_themselves():
    s = wheel().study(
        {"w": [50.0, 70.0, 100.0, 130.0]}, ["end(R.angle)"], t_end=LAST, method="rk45", step=0.03125,
        coordinates="absolute",
    )  # fmt: skip
    off = np.abs(s["end(R.angle)"] - LAST * np.array([50.0, 70.0, 100.0, 130.0]))
    assert sorted(s.doubtful) == np.flatnonzero(off > 0.02).tolist() == [2, 3]
