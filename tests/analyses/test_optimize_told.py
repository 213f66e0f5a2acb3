"""What a search says at its end: in our words, and a zero slope is not called found."""

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
    assert "every derivative is zero where it begins" in found.message


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
