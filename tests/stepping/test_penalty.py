"""Contacts that give way: Hertz' impact and indentation, what Hunt and Crossley's law loses, and what is stored."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

G, R = 9.81, 0.1
K = 1e7


def ball(gravity: float = 0.0, gap: float = 0.0, speed: float = 0.0, **law: object) -> fb.Mechanism:
    """1 kg over a floor that gives way."""
    m = fb.Mechanism("ball", gravity=(0, 0, -gravity))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=R), mass=1, position=(0, 0, R + gap), velocity=(0, 0, -speed)))
    m.add(fb.Contact(friction=0.3, **law))
    return m


def hit(h: float, t_end: float, **law: object) -> fb.Result:
    """An impact at 1 m/s in n equal steps of about h, each of them an output."""
    return ball(speed=1.0, **law).simulate(t_end, outputs=round(t_end / h) + 1, method=fb.Impulse(step=1.01 * h))


def test_an_impact_by_hertz() -> None:
    """Deepest (5 m v^2 / 4 k)^(2/5), over after 2.9432 of that over v (Johnson 1985, section 11.4), nothing lost."""
    deepest = (5 / (4 * K)) ** 0.4
    over = 2.94328 * deepest
    errors = []
    for n in (20, 40):
        run = hit(over / n, 1.5 * over, law="hertz", stiffness=K)
        errors.append(run["ball"].vz[-1] - 1)
        assert R - run["ball"].z.min() == pytest.approx(deepest, rel=1e-4)
        assert np.abs(run.energy.balance).max() < 1e-12
        assert run.energy.contact_elastic.max() == pytest.approx(0.5, rel=1e-2)
        assert run.energy.impact_loss[-1] == pytest.approx(-errors[-1], abs=1e-8)
    assert abs(errors[0]) < 1e-4 and abs(errors[1]) < 0.25 * abs(errors[0])
    # it has left when the height is R again: interpolated, as it flies freely then
    left = run.t[-1] - (run["ball"].z[-1] - R) / run["ball"].vz[-1]
    assert left == pytest.approx(over, rel=2e-3)
    force = np.abs(np.diff(run["ball"].vz)).max() / run.t[1]
    assert force == pytest.approx(K * deepest**1.5, rel=5e-3)


def test_hunt_and_crossley_lose_what_their_law_says() -> None:
    """v dv / (1 + c v) integrates to e: v/c - ln(1 + c v) / c^2 is the same at 1 and at -e; 1 - 2/3 c for small c."""

    def side(v: float, c: float) -> float:
        return v / c - np.log1p(c * v) / c**2

    for c in (0.01, 0.3):
        run = hit(2.5e-5, 8e-3, law="hunt-crossley", stiffness=K, dissipation=c)
        e = run["ball"].vz[-1]
        assert side(-e, c) == pytest.approx(side(1.0, c), rel=1e-4)
        assert np.abs(run.energy.balance).max() < 1e-12
        assert run.energy.impact_loss[-1] == pytest.approx(0.5 * (1 - e * e), rel=1e-9)
        if c == 0.01:
            assert e == pytest.approx(1 - 2 / 3 * c, abs=1e-4)


def test_a_linear_law_that_does_not_pull() -> None:
    """e = exp(-b (pi - atan2(2 b w, w^2 - b^2)) / w) with b = damping/2m, w^2 = k/m - b^2 (Schwager, Poeschel 2007)."""
    k, damping = 1e5, 100.0
    b = damping / 2
    w = np.sqrt(k - b * b)
    run = hit(2.5e-5, 0.02, law="linear", stiffness=k, damping=damping)
    assert run["ball"].vz[-1] == pytest.approx(
        np.exp(-b / w * (np.pi - np.arctan2(2 * b * w, w * w - b * b))), rel=1e-4
    )


@pytest.mark.parametrize("h", [1e-3, 2e-2, 0.1])
@pytest.mark.parametrize(
    ("law", "overlap"),
    [
        ({"law": "hertz", "stiffness": K}, (G / K) ** (2 / 3)),
        ({"law": "hunt-crossley", "stiffness": K, "exponent": 2, "dissipation": 1}, (G / K) ** 0.5),
        ({"law": "linear", "stiffness": 1e4, "damping": 20}, G / 1e4),
    ],
)
def test_rest_under_weight_at_any_step(law: dict, overlap: float, h: float) -> None:
    """Where the force is the weight it stays; that overlap is no fault."""
    m = ball(gravity=G, gap=-overlap, **law)
    run = m.simulate(1.0, outputs=11, method=fb.Impulse(step=h))
    assert R - run["ball"].z == pytest.approx(overlap, rel=1e-5)
    assert run.contacts.force[-1] == pytest.approx([0, 0, G], rel=1e-5)
    assert run.energy.contact_elastic[0] == pytest.approx(
        overlap * G / (law.get("exponent", 1 if law["law"] == "linear" else 1.5) + 1)
    )
    assert not run.health.warnings and run.health.contact.worst_overlap == 0.0


def test_far_too_large_steps_bring_to_rest_and_gain_nothing() -> None:
    """The impact takes 1.3 ms; steps of 10 ms."""
    m = ball(gravity=G, gap=0.05, law="hertz", stiffness=1e9)
    run = m.simulate(1.0, outputs=101, method=fb.Impulse(step=0.01))
    assert abs(run["ball"].vz[-1]) < 1e-6
    assert R - run["ball"].z[-1] == pytest.approx((G / 1e9) ** (2 / 3), rel=1e-3)
    assert np.abs(run.energy.balance).max() < 1e-10
    assert run.energy.total.max() <= run.energy.total[0] + 1e-12
