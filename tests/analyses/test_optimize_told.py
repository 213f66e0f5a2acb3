"""What a search says at its end: in our words, and a zero slope is not called found."""

import numpy as np
import pytest

import flyball as fb


def spring(k=100.0):
    m = fb.Mechanism("scale", planar=True, gravity=(0, -9.81), parameters={"k": k, "other": 1.0})
    m.add(fb.Body("b", mass=1.0, inertia=1.0, position=(0, 0)))
    m.add(fb.Prismatic("p", "ground", "b", at=(0, 0), axis=(0, 1)))
    m.add(fb.CoordinateSpring("s", "p.displacement", stiffness="k"))
    return m


def test_a_zero_slope_is_not_called_found():
    found = spring().optimize(["b.y"], ["other"], target=[-0.2], analysis="equilibrium")
    assert not found.success
    assert "every derivative is zero at the start" in found.message


def test_the_reason_is_told_in_our_words():
    found = spring().optimize(["b.y"], ["k"], target=[-0.2], analysis="equilibrium")
    assert found.parameters["k"] == pytest.approx(9.81 / 0.2, rel=1e-6)
    assert found.success
    assert "`" not in found.message
    few = spring().optimize(["b.y"], ["k"], target=[-0.2], analysis="equilibrium", evaluations=1)
    assert "as evaluations= allows" in few.message


@pytest.mark.parametrize("how", [{"target": [-0.2]}, {"minimize": lambda y: float((y[0, 0] + 0.2) ** 2)}])
def test_an_interrupt_keeps_the_best(how):
    def stop(done):
        if done > 0.03:
            raise KeyboardInterrupt

    with pytest.raises(fb.Interrupted, match=r"interrupted by the user after [4-9] analyses") as ended:
        spring().optimize(["b.y"], ["k"], analysis="equilibrium", progress=stop, evaluations=100, **how)
    best = ended.value.result
    assert not best.success
    assert best.cost < best.start_cost
    assert best.values[0, 0] == pytest.approx(-9.81 / best.parameters["k"], rel=1e-9)


def slider_crank():
    """A driven crank of 0.1 m and a rod of b: shorter than 0.1 m it locks before the crank is upright."""
    m = fb.Mechanism("press", planar=True, parameters={"b": 0.3})
    m.add(fb.Body("crank", mass=1, inertia=1), fb.Body("rod", mass=1, inertia=1, position=(0.1, 0)))
    m.add(fb.Body("s", mass=1, inertia=1, position=("0.1+b", 0)), fb.Frame("e", "rod", position=("b", 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(0.1, 0)))
    m.add(fb.Revolute("C", "e", "s"), fb.Prismatic("G", "ground", "s", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("mo", "A.angle", "2*t"))
    return m


def test_a_search_steps_back_where_the_mechanism_locks():
    """The slider as near as it goes: a rod of 0.1 m, as long as the crank."""
    motion = {"analysis": "motion", "t_end": 1, "outputs": 5}
    found = slider_crank().optimize(["s.x"], ["b"], target=np.full((5, 1), 0.02), evaluations=15, **motion)
    assert 0.1 < found.parameters["b"] < 0.11
    assert found.cost < 0.2 * found.start_cost
    assert "could not be computed and the search stepped back; the last with b = 0.0" in found.message
    short = slider_crank().changed({})
    short.parameters["b"] = 0.09
    with pytest.raises(fb.SimulationError, match=r"with b = 0\.09: .* stop at t = 0\.5\d* s"):
        short.optimize(["s.x"], ["b"], target=np.full((5, 1), 0.02), **motion)
    with pytest.raises(fb.SimulationError, match=r"stop at t = 0\.5\d* s") as error:
        short.sensitivity(["s.x"], ["b"], analysis="motion", t_end=1)
    assert error.value.t == pytest.approx(0.5 * np.arcsin(0.9), abs=1e-3)
