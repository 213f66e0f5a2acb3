"""A user's function that fails stops the motion, and its exception comes out, with element, arguments and time."""

import math
import warnings

import numpy as np
import pytest

import flyball as fb


class Thing:
    """Numba does not know it, so a function that speaks of it is called back in Python."""


THING = Thing()


def cart(**laws) -> fb.Mechanism:
    m = fb.Mechanism("cart", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(*(fb.Actuator(name, "P.displacement", force=law) for name, law in laws.items()))
    return m


def late(t, value):
    if t > 0.3:
        raise ValueError("too late")
    return 1.0


def late_in_python(t, value):
    THING.seen = t
    if t > 0.3:
        raise ValueError("too late")
    return 1.0


def root(t, value):
    return math.sqrt(0.3 - t)


def tabled(t, value):
    return np.array([1.0, 2.0])[int(t * 1e9)]


@pytest.mark.filterwarnings("ignore::flyball.PerformanceNotice")
@pytest.mark.parametrize("law", [late, late_in_python, root])
def test_the_exception_comes_out_with_element_arguments_and_time(law):
    with pytest.raises(fb.SimulationError) as stopped:
        cart(A="1", B=law).simulate(1.0, outputs=101)
    error = stopped.value
    cause = error.__cause__
    assert isinstance(cause, ValueError)
    assert str(cause) in str(error)
    assert (
        f"force of Actuator 'B': the Python function <{law.__name__}(t, value)> raises ValueError for t = 0.3"
        in str(error)
    )
    assert error.t == pytest.approx(0.3, abs=1e-6)
    x = error.result["P"].displacement
    assert 0.29 <= error.result.t[-1] <= 0.3
    assert x[1] == pytest.approx(1e-4 if law is not root else x[1], rel=1e-6)
    assert np.isfinite(x).all()
    assert not error.result.health.success
    assert "too late" in error.result.health.message or law is root


@pytest.mark.filterwarnings("ignore::flyball.PerformanceNotice")
@pytest.mark.parametrize("way", ["compiled", "called back"])
def test_it_may_raise_at_the_very_start(way):
    def at_once(t):
        if way == "called back":
            THING.seen = t
        return 1.0 / (0.0 * t) if t < 1e9 else 0.0

    def key(t):
        THING.seen = t
        return {}["missing"]

    law = at_once if way == "compiled" else key
    with pytest.raises(fb.SimulationError, match=r"force of Actuator 'A': the Python function <.*for t = 0") as stopped:
        cart(A=law).simulate(1.0)
    assert isinstance(stopped.value.__cause__, ZeroDivisionError if way == "compiled" else KeyError)
    assert stopped.value.t == 0.0


@pytest.mark.filterwarnings("ignore::flyball.PerformanceNotice")
def test_what_is_no_number():
    def words(t):
        THING.seen = t
        return "plenty"

    def nothing(t):
        return math.inf

    with pytest.raises(
        fb.SimulationError, match=r"<words\(t\)> for t = 0: it returned 'plenty' \(str\); a law returns a num"
    ):
        cart(A=words).simulate(1.0)
    with pytest.raises(
        fb.SimulationError, match=r"<nothing\(t\)> gives inf for t = 0; it must give a finite number"
    ) as e:
        cart(A=nothing).simulate(1.0)
    assert e.value.__cause__ is None


def test_an_index_out_of_range_is_found():
    with pytest.raises(fb.SimulationError, match=r"<tabled\(t, value\)> (raises IndexError|gives)"):
        cart(A=tabled).simulate(1.0)


@pytest.mark.filterwarnings("ignore::flyball.PerformanceNotice")
def test_what_is_overcome_is_remarked_in_the_health_report():
    """The law fails beyond 1.0, where steps that are too wide try it; the motion itself never gets there."""

    def fence(value):
        if value > 1.0:
            raise ValueError("beyond the fence")
        return -1e4 / (1.0 + 1e-12 - value) + 1e4

    calls = []

    def once(t):
        calls.append(t)
        if len(calls) == 40:
            raise RuntimeError("the fortieth call")
        return 1.0

    r = cart(A=once).simulate(1.0)
    assert r["P"].displacement[-1] == pytest.approx(0.5)
    (warning,) = r.health.warnings
    assert "force of Actuator 'A': the Python function <once(t)> raises RuntimeError" in warning
    assert "the fortieth call" in warning
    assert "taken again" in warning
    assert warning in dict(r.health.lines()).values()


def test_a_sound_law_leaves_no_remark():
    def law(t, value, rate):
        return math.cos(t) - value - rate

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", fb.PerformanceNotice)
        assert cart(A=law).simulate(1.0).health.warnings == ()


@pytest.mark.filterwarnings("ignore::flyball.PerformanceNotice")
def test_it_may_raise_when_the_result_is_read():
    fails = []

    def moody(t):
        THING.seen = t
        if fails:
            raise OSError("gone by now")
        return 2.0 * t

    r = cart(A=moody).simulate(1.0)
    assert r["P"].displacement[-1] == pytest.approx(1 / 3)
    fails.append(True)
    with pytest.raises(fb.AnalysisError, match=r"Actuator 'A': its law raises OSError at t = 0 s: gone by now") as read:
        r["A"].force  # noqa: B018
    assert isinstance(read.value.__cause__, OSError)


def test_parameters_that_only_functions_use_are_used():
    m = fb.Mechanism("cart", planar=True, gravity=(0, -9.81), parameters={"k": 3.0, "idle": 1.0})
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.PointForce("F", "b", force=(lambda t, k: k * t, 0)))
    assert [w for w in m.check().warnings if "parameter" in w] == ["parameter 'idle' is used nowhere"]
