"""One table of names: what a part is asked as an attribute can be asked as a curve, and the reverse."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import flyball as fb
from flyball.model.quantities import quantities
from flyball.results.part_views.base import NamedQuantities
from tests.errors.test_new_elements import plane, space

SQUARE = [(0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1)]
ASIDE = {
    "pulls",
    "wraps",
    "course",
    "wrench",
    "element",
    "instead",
    "names",
    "title",
    "undetermined",
    "unit",
    "drift",
    "work",
}
"""Attributes that are no quantity over time, or a pair or list of such; the work of all parts is a dict."""


@functools.cache
def flat() -> fb.Result:
    m = plane()
    m.add(fb.GearPair("G", "A", "W", teeth=(1, 2)), fb.Driver("D", "S.displacement", "0.1*t"), fb.IMU("imu", "eye"))
    m.add(fb.Sensor("s", "A.angle"), fb.Sensor("again", "s.value"), fb.Motor("M", "A", torque=1))
    m.add(
        fb.JointFriction("F", "S", static=0.1, stick_speed=1e-3),
        fb.PointForce("push", "cart", force=(1, 2)),
        fb.Table("u", x=[0, 1], y=[0, 1]),
    )
    m.add(fb.SpringDamper("k", "ground", "cart", stiffness=3, at=((0, 5), (0, 1))))
    return m.simulate(0.1, outputs=3)


@functools.cache
def deep() -> fb.Result:
    m = space()
    m.add(fb.Cylindrical("cyl", "a", "d", at=(0, 0, 0), axis=(0, 0, 1)), fb.IMU("imu", "b"))
    m.add(fb.PointForce("push", "a", force=(1, 2, 3)))
    return m.simulate(0.1, outputs=3)


@pytest.fixture(scope="module", params=[flat, deep])
def run(request) -> fb.Result:
    return request.param()


def test_every_name_is_an_attribute_and_a_curve(run):
    for name in run.names():
        owner, dot, what = name.partition(".")
        if dot:
            values = run[name]
            np.testing.assert_array_equal(values, getattr(run[owner], what))
            assert len(values) == len(run.t), name
            x = quantities(run.model, owner)[what]
            assert values[0].size == (x.width or 1), name
            assert (values.ndim > 1) == (x.width > 0), name
            assert what in dir(run[owner])
            assert name in run
        else:
            assert isinstance(run[name], NamedQuantities)


def test_every_attribute_is_a_curve(run):
    """Public properties of the views that hold numbers over time stand in the table."""
    for owner in run.parts():
        view = run[owner]
        properties = {
            k for c in type(view).__mro__ for k in vars(c) if not k.startswith("_") and not callable(vars(c)[k])
        }
        for what in properties - ASIDE:
            has = f"{owner}.{what}" in run
            assert has or (what == "angle" and not run.planar), f"{type(view).__name__}.{what}"


def test_components_are_those_of_their_wholes(run):
    for owner in run.parts():
        for what, x in quantities(run.model, owner).items():
            if x.of:
                whole = run[f"{owner}.{x.of}"]
                np.testing.assert_array_equal(
                    run[f"{owner}.{what}"], whole if x.component is None else whole[:, x.component]
                )


def test_listed_curves_and_data_sets_are_of_the_table(run):
    curves = {f"{o}.{k}" for o in run.parts() for k, x in quantities(run.model, o).items() if x.curve}
    assert set(run.channels()) <= curves
    missing = curves - set(run.channels())
    assert all(not run[k].any() for k in missing), missing  # components of given forces that are always zero
    arrays = {f"{o}.{k}" for o in run.parts() for k, x in quantities(run.model, o).items() if x.array}
    data = run.to_xarray()
    assert set(data.data_vars) == arrays
    for k in arrays:
        assert data[k].attrs["units"] == run.channel(k)[0]


def test_both_ways():
    r = flat()
    np.testing.assert_array_equal(r["A.force"], r["A"].force)
    np.testing.assert_array_equal(r["cart"].omega, r["cart"].angular_velocity)
    np.testing.assert_array_equal(r["energy"].gravity, r["energy.gravity"])
    np.testing.assert_array_equal(r["G"].effort_1, r["G"].effort("A.angle"))
    assert "A.rate" in r._ipython_key_completions_()
    assert "again.value" in r


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("cart.omeg", r"Body 'cart' has no curve 'omeg' \(did you mean 'omega'\?\); it has x, y, angle"),
        ("carts", r"no part named 'carts' \(did you mean 'cart'\?\)"),
        ("carts.x", r"no part named 'carts' \(did you mean 'cart'\?\)"),
        ("energy.work", "result.energy.work"),
        ("energy.knetic", r"did you mean 'kinetic'"),
        ("u", "a result has no data of Table 'u'"),
        (0, "a result is read by name, for instance"),
    ],
)
def test_unknown_names_get_candidates(name, message):
    with pytest.raises(fb.ModelError, match=message):
        flat()[name]


def test_unknown_attributes_get_candidates():
    r = flat()
    with pytest.raises(AttributeError, match="did you mean 'omega'"):
        r["cart"].omeg  # noqa: B018
    with pytest.raises(AttributeError, match="did you mean 'angle_rate'"):
        r["A"].angle_rat  # noqa: B018
    with pytest.raises(AttributeError, match="use roll, pitch, yaw, rotation or quaternion"):
        deep()["a"].angle  # noqa: B018


def test_vectors_are_no_outputs():
    m = flat().model.copy()
    with pytest.raises(fb.ModelError, match=r"'A.force' has 2 components; name one: A.fx, A.fy"):
        m.sensitivity(["A.force"], [])
    with pytest.raises(
        fb.ModelError, match=r"'A.force' has 2 numbers, and a sensor measures one; measure A.fx or A.fy"
    ):
        m.add(fb.Sensor("f", "A.force"))
