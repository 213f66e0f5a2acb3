"""Fits to measurements: closed forms of a linear problem, coverage of the intervals, files, units, gaps, refusals."""

import numpy as np
import pytest
from scipy.stats import t as student

import flyball as fb


def cart(**parameters: float) -> fb.Mechanism:
    """x = x0 + v t + F t^2 / 4 and a second coordinate y = w t: linear in the parameters."""
    m = fb.Mechanism("carts", planar=True, parameters={"v": 1.0, "F": 1.0, "w": 0.5, "u": 0.0} | parameters)
    m.add(fb.Body("a", mass=2, inertia=1, velocity=("v + u", 0)), fb.Body("b", mass=1, inertia=1, velocity=("w", 0)))
    m.add(fb.PointForce("push", "a", force=("F", 0)))
    return m


T = np.linspace(0.1, 2.0, 20)


def test_a_linear_problem_in_closed_form():
    rng = np.random.default_rng(3)
    x = 1.5 * T + 2.0 * T**2 / 4 + 0.02 * rng.normal(size=len(T))
    found = cart().fit({"t [s]": T, "a.x [mm]": 1000 * x}, ["v", "F"], progress=False)
    A = np.stack([T, T**2 / 4], axis=1)
    best, rest = np.linalg.lstsq(A, x, rcond=None)[:2]
    variance = rest[0] / (len(T) - 2)
    covariance = variance * np.linalg.inv(A.T @ A)
    assert [found.parameters["v"], found.parameters["F"]] == pytest.approx(best, rel=1e-7)
    assert found.covariance == pytest.approx(covariance, rel=1e-6)
    wide = student.ppf(0.975, len(T) - 2) * np.sqrt(covariance[0, 0])
    assert found.intervals["v"] == pytest.approx((best[0] - wide, best[0] + wide), rel=1e-6)
    assert found.noise["a.x"] == pytest.approx(np.sqrt(variance), rel=1e-6)
    known = cart().fit({"t": T, "a.x": x}, ["v", "F"], noise={"a.x": "3 cm"}, progress=False)
    assert known.covariance == pytest.approx(0.03**2 * np.linalg.inv(A.T @ A), rel=1e-6)
    assert "correlation" in repr(found) and "95 %" in repr(found)


def test_curves_count_by_their_noise():
    """Two curves of one parameter: the weighted mean of both slopes."""
    m = cart()
    m = m.changed({"b": fb.Body("b", mass=1, inertia=1, velocity=("v", 0)), "push": None})
    rng = np.random.default_rng(4)
    x, y = 2.0 * T + 0.5 * rng.normal(size=len(T)), 2.0 * T + 0.001 * rng.normal(size=len(T))
    found = m.fit({"t": T, "a.x": x, "b.x": y}, {"v": (0.0, 10.0)}, progress=False)
    assert found.parameters["v"] == pytest.approx((T @ y) / (T @ T), rel=2e-5)
    assert found.noise["a.x"] == pytest.approx(0.5, rel=0.4)
    assert found.noise["b.x"] == pytest.approx(0.001, rel=0.4)


def test_intervals_cover_the_truth():
    """A damped pendulum, nonlinear in its length: 95 % intervals hold the truth in about 95 % of the data sets."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"l": 0.5, "c": 0.02})
    m.add(fb.Body("bob", mass=1, inertia=0.01, position=("l", 0)), fb.Revolute("A", "ground", "bob", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("friction", "A", damping="c"))
    t = np.linspace(0.1, 1.5, 15)
    exact = m.simulate(1.5, outputs=t, parameters={"l": 0.47, "c": 0.05}, rtol=1e-9)["A.angle"]
    rng = np.random.default_rng(0)
    inside = []
    for _ in range(30):
        data = {"t": t, "A.angle": exact + 0.02 * rng.normal(size=len(t))}
        found = m.fit(data, ["l", "c"], rtol=1e-6, progress=False)
        inside += [low < x < high for x, (low, high) in zip((0.47, 0.05), found.intervals.values(), strict=True)]
    assert 0.86 <= np.mean(inside) <= 1.0  # 60 of them: 0.95 with a standard deviation of 0.03


def test_files_and_gaps(tmp_path):
    x = 1.5 * T + 0.5 * T**2
    rows = [
        "time [ms],a.x [cm],b.x",
        *(f"{1000 * t},{100 * p if k % 3 else ''},{0.7 * t}" for k, (t, p) in enumerate(zip(T, x))),
    ]
    path = tmp_path / "test.csv"
    path.write_text("\n".join(rows), encoding="utf-8")
    found = cart().fit(path, ["v", "F", "w"], noise={"a.x": 0.01, "b.x": "1 cm"}, progress=False)
    assert found.parameters == pytest.approx({"v": 1.5, "F": 2.0, "w": 0.7}, rel=1e-7)
    assert np.isnan(found.residuals[:, 0]).sum() == 7
    assert found.as_dict()["intervals"].keys() == {"v", "F", "w"}


@pytest.mark.parametrize(
    ("data", "to", "options", "message"),
    [
        ({"t": T}, ["v"], {}, "at least one measured curve"),
        ({"t": T[::-1], "a.x": T}, ["v"], {}, "ascending"),
        ({"t": T, "a.x": T[1:]}, ["v"], {}, "'a.x' has 19 values at 20 times"),
        ({"t": T, "a.z": T}, ["v"], {}, "no curve 'z'"),
        ({"t": T, "a.x [deg]": T}, ["v"], {}, "deg"),
        ({"t": T, "a.x": T * np.nan}, ["v"], {}, "no finite value"),
        ({"t": T, "a.x": T}, ["speed"], {}, "no parameter 'speed'"),
        ({"t": T, "a.x": T}, ["v"], {"noise": {"b.x": 1}}, "'b.x' is not among the data"),
        ({"t": T, "a.x": T, "b.x": T}, ["v"], {"noise": {"a.x": 1}}, "also of 'b.x', or of none"),
        ({"t": T, "a.x": T}, ["v"], {"confidence": 95}, "between 0 and 1"),
        ("missing.csv", ["v"], {}, "cannot read 'missing.csv'"),
    ],
)
def test_refusals(data, to, options, message):
    with pytest.raises(fb.ModelError, match=message):
        cart().fit(data, to, progress=False, **options)


def test_what_the_data_do_not_determine_is_named():
    with pytest.raises(fb.AnalysisError, match=r"do not determine (v and u|u and v) separately"):
        cart().fit({"t": T, "a.x": 1.5 * T}, ["v", "u"], progress=False)
    with pytest.raises(fb.AnalysisError, match="do not determine w"):
        cart().fit({"t": T, "a.x": 1.5 * T}, ["v", "w"], progress=False)
