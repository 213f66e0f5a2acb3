"""Contacts that give way: Hertz' impact and indentation, what Hunt and Crossley's law loses, and what is stored."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

import flyball as fb
from flyball.simulation.impulse_stepping.contact_laws import mean_elastic_force

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
    return ball(speed=1.0, **law).simulate(t_end, outputs=round(t_end / h) + 1, method=fb.Stepping(step=1.01 * h))


def test_an_impact_by_hertz() -> None:
    """Deepest (5 m v^2 / 4 k)^(2/5), over after 2.9432 of that over v (Johnson 1985, section 11.4), nothing lost."""
    deepest = (5 / (4 * K)) ** 0.4
    over = 2.94328 * deepest
    errors = []
    for n in (20, 40):
        run = hit(over / n, 1.5 * over, law="hertz", stiffness=K)
        errors.append(run["ball"].vz[-1] - 1)
        assert R - run["ball"].z.min() == pytest.approx(deepest, rel=1e-4)
        assert np.abs(run.energy.balance).max() < 1e-10
        assert run.energy.contact_elastic.max() == pytest.approx(0.5, rel=1e-2)
        assert run.energy.numerical_loss[-1] == pytest.approx(-errors[-1], abs=1e-8)
        assert not run.energy.impact_loss.any()
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
        lost = run.energy.impact_loss[-1] + run.energy.numerical_loss[-1]
        assert lost == pytest.approx(0.5 * (1 - e * e), rel=1e-9)
        assert abs(run.energy.numerical_loss[-1]) < 1e-3 * lost
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
    run = m.simulate(1.0, outputs=11, method=fb.Stepping(step=h))
    assert R - run["ball"].z == pytest.approx(overlap, rel=1e-5)
    assert run.contacts.force[-1] == pytest.approx([0, 0, G], rel=1e-5)
    assert run.energy.contact_elastic[0] == pytest.approx(
        overlap * G / (law.get("exponent", 1 if law["law"] == "linear" else 1.5) + 1)
    )
    assert not run.health.warnings and run.health.contact.worst_overlap == 0.0


def test_steel_by_youngs_modulus() -> None:
    """k = 4/3 E* sqrt(R/2), E* = E / 2 (1 - nu^2) of two equal balls; the law is that of half their mass."""
    r, e, nu, density, v = 0.05, 210e9, 0.3, 7800.0, 1.0
    k = 4 / 3 * e / (2 * (1 - nu**2)) * np.sqrt(r / 2)
    deepest = (5 * density * 4 / 3 * np.pi * r**3 / 2 * v**2 / (4 * k)) ** 0.4
    m = fb.Mechanism("steel")
    m.add(fb.Material("steel", friction=0.2, youngs_modulus="210 GPa", poissons_ratio=0.3))
    for name, side in (("a", -1), ("b", 1)):
        shape = fb.Sphere(radius=r)
        place, velocity = (side * r, 0, 0), (-side * v / 2, 0, 0)
        m.add(fb.Body(name, shape=shape, density=density, position=place, velocity=velocity, material="steel"))
    m.add(fb.Contact(law="hertz"))
    t_end = 3.5 * deepest / v
    run = m.simulate(t_end, outputs=101, method=fb.Stepping(step=t_end / 99))
    assert (2 * r + run["a"].x - run["b"].x).max() == pytest.approx(deepest, rel=1e-3)
    assert run["b"].vx[-1] - run["a"].vx[-1] == pytest.approx(v, rel=1e-6)
    assert np.abs(run["a"].vx + run["b"].vx).max() < 1e-12
    assert run.contacts.force[:, 0].max() == pytest.approx(k * deepest**1.5, rel=5e-3)


@pytest.mark.parametrize("outputs", [11, 501])
def test_the_usual_step_follows_the_stiffness(outputs: int) -> None:
    """Equal balls swap their velocities whatever the outputs are; a long step says what it takes."""
    m = fb.Mechanism("swap")
    for name, x in (("a", 0.0), ("b", 0.3)):
        m.add(fb.Body(name, mass=1, shape=fb.Sphere(radius=R), position=(x, 0, 0), velocity=(0.3 - x, 0, 0)))
    m.add(fb.Contact(friction=0, law="hertz", stiffness=1e6))
    run = m.simulate(2.0, outputs=outputs)
    assert [run["a"].vx[-1], run["b"].vx[-1]] == pytest.approx([0.0, 0.3], abs=1e-4)
    assert not run.health.warnings
    bounded = m.simulate(2.0, outputs=outputs, method="impulse", max_step=4e-3)
    assert bounded["b"].vx[-1] == pytest.approx(0.3, abs=1e-4)
    long = m.simulate(2.0, outputs=11, method=fb.Stepping(step=5e-3))
    lost = long.energy.total[0] - long.energy.total[-1]
    assert lost > 0.1 * long.energy.total[0]
    assert long.energy.numerical_loss[-1] == pytest.approx(lost, rel=1e-9)
    assert not long.energy.impact_loss.any() and any("numerical_loss" in x for x in long.health.doubtful)


def on_a_mat(**law: object) -> fb.Mechanism:
    """A ball over a box, hard to each other, on a floor that gives way."""
    m = fb.Mechanism("mat", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    m.add(fb.Body("box", shape=fb.Box(edges=(0.2, 0.2, 0.1)), mass=2, position=(0, 0, 0.05)))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.05), mass=1, position=(0, 0, 0.2)))
    m.add(fb.Contact(friction=0.3, restitution=0.7))
    m.add(fb.Contact("mat", between="floor", others=["box", "ball"], friction=0.3, **law))
    return m


def test_hard_and_soft_contacts_in_one_scene() -> None:
    """The hard impact takes no time, so that the mat gives nothing to it; then all rest, the box in the mat."""
    m = on_a_mat(law="hunt-crossley", stiffness=1e6, dissipation=1)
    m.replace(fb.Body("ball", shape=fb.Sphere(radius=0.05), mass=1, position=(0, 0, 0.25)))
    run = m.simulate(0.3, outputs=301, method=fb.Stepping(step=1e-3))
    k = int(np.argmax(np.diff(run["ball"].vz) > 0.1))
    v = -run["ball"].vz[k]
    assert run["ball"].vz[k + 1] == pytest.approx(v * (0.7 * 2 - 1) / 3, abs=2 * G * 1e-3)
    assert run["box"].vz[k + 1] == pytest.approx(-1.7 * v / 3, abs=5e-2)  # the mat acts on it for the rest of the step
    assert np.abs(run.energy.balance).max() < 1e-9
    run = on_a_mat(law="hunt-crossley", stiffness=1e6, dissipation=1).simulate(2.0, outputs=21)
    assert 0.05 - run["box"].z[-1] == pytest.approx((3 * G / 4 / 1e6) ** (2 / 3), rel=1e-4)
    assert run["ball"].z[-1] - run["box"].z[-1] == pytest.approx(0.1, abs=1e-8)
    assert not run.health.warnings


@pytest.mark.parametrize("solver", ["gauss-seidel", "newton"])
def test_friction_on_what_gives_way(solver: str) -> None:
    """mu g while it slides; by every solver (``tests/cone`` has the others)."""
    m = fb.Mechanism("box", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    position = (0, 0, 0.05 - 2 * G / 4e5)
    m.add(fb.Body("box", shape=fb.Box(edges=(0.2, 0.2, 0.1)), mass=2, position=position, velocity=(1, 0, 0)))
    m.add(fb.Contact(friction=0.3, law="linear", stiffness="100 kN/m", damping=200))
    run = m.simulate(0.2, outputs=11, method=fb.Stepping(step=2e-3, solver=solver))
    assert run["box"].vx[-1] == pytest.approx(1 - 0.3 * G * 0.2, rel=1e-8)
    assert np.abs(run.energy.balance).max() < 1e-7
    assert run.energy.friction_loss[-1] == pytest.approx(0.5 * 2 * (1 - run["box"].vx[-1] ** 2), rel=1e-2)


def test_a_pendulum_hits_a_wall_that_gives_way() -> None:
    """What joints hold together: it swings back as high as it came from."""
    m = fb.Mechanism("pendulum", gravity=(0, 0, -G))
    m.add(fb.Ground("wall", shape=fb.Plane(normal=(1, 0, 0)), position=(-R, 0, 0)))
    m.add(fb.Body("bob", shape=fb.Sphere(radius=R), mass=1, position=(0.8, 0, 0.4)))
    m.add(fb.Revolute("hinge", "ground", "bob", at=(0, 0, 1), axis=(0, 1, 0)))
    m.add(fb.Contact(friction=0, law="hertz", stiffness=1e6))
    run = m.simulate(1.5, outputs=501, method=fb.Stepping(step=1e-3))
    assert np.abs(run.energy.balance).max() < 1e-4
    assert run["bob"].z[250:].max() == pytest.approx(0.4, abs=3e-3)


def test_stiff_balls_that_settle_make_no_energy() -> None:
    """A step of 5 ms where an impact takes 1 ms: overlap of surfaces that turned is no spring's."""
    m = fb.Mechanism("heap", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    corners = np.array(np.meshgrid([0, 1, 2], [0, 1, 2], [0, 1])).reshape(3, -1).T
    place = 0.021 * corners + (0, 0, 0.011) + 0.003 * np.sin(7 * corners[:, ::-1])
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.01), density=2500, position=place))
    m.add(fb.Contact(friction=0.3, law="hunt-crossley", stiffness=1e7, dissipation=1))
    run = m.simulate(1.0, outputs=51)
    start = run.energy.total[0]
    assert run.energy.total.max() <= start + 1e-3 * np.ptp(run.energy.gravity)
    assert np.abs(run.energy.balance).max() < 1e-2 * np.ptp(run.energy.gravity)


def test_far_too_large_steps_bring_to_rest_and_gain_nothing() -> None:
    """The impact takes 1.3 ms; steps of 10 ms."""
    m = ball(gravity=G, gap=0.05, law="hertz", stiffness=1e9)
    run = m.simulate(1.0, outputs=101, method=fb.Stepping(step=0.01))
    assert abs(run["ball"].vz[-1]) < 1e-6
    assert R - run["ball"].z[-1] == pytest.approx((G / 1e9) ** (2 / 3), rel=1e-3)
    assert np.abs(run.energy.balance).max() < 1e-10
    assert run.energy.total.max() <= run.energy.total[0] + 1e-12


@pytest.mark.parametrize("n", [1.0, 1.5, 2.2])
@pytest.mark.parametrize("change", [0.5, 3e-3, 1e-3, 1e-4, 1e-7, -1e-3, -0.5])
def test_mean_force_of_a_power_law(n: float, change: float) -> None:
    """(b^(n+1) - a^(n+1)) / (n + 1) (b - a), and its slope with b, however little a and b differ; with fifty digits."""
    k, a = 2.0, 0.3
    b = a * (1.0 + change)
    with mpmath.workdps(50):
        power = mpmath.mpf(n)

        def mean(y):
            return k * (y ** (power + 1) - mpmath.mpf(a) ** (power + 1)) / ((power + 1) * (y - mpmath.mpf(a)))

        wanted = float(mean(mpmath.mpf(b))), float(mpmath.diff(mean, mpmath.mpf(b)))
    found = mean_elastic_force(k, n, a, b)
    assert found[0] == pytest.approx(wanted[0], rel=1e-12)
    assert found[1] == pytest.approx(wanted[1], rel=1e-7)


@pytest.mark.parametrize("height", [0.0, 1e6])
def test_what_a_step_takes_is_judged_wherever_heights_are_counted_from(height: float) -> None:
    """A step of 10 ms takes most of a ball's fall by 0.2 m in an impact of 2 ms."""
    m = fb.Mechanism("ball", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(position=(0, 0, height))))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=R), mass=1, position=(0, 0, height + R + 0.2)))
    m.add(fb.Contact(friction=0.3, law="hertz", stiffness=K))
    run = m.simulate(1.0, outputs=11, method=fb.Stepping(step=1e-2))
    assert run.energy.numerical_loss[-1] > 0.5 * G * 0.2
    assert any("numerical_loss" in text for text in run.health.doubtful)
