"""A rod that strikes the floor askew, with friction (Routh 1905, article 186; Stronge 2000, chapter 5)."""

import numpy as np
import pytest

import flyball as fb

L, M = 1.0, 1.0
J = M * L**2 / 12


def rod(angle, velocity, spin, mu, e):
    """A thin rod in the plane, its lower end just above the floor, ``angle`` from the horizontal; no gravity."""
    m = fb.Mechanism("rod", planar=True, gravity=(0, 0))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))))
    r = 1e-4
    shape = fb.Capsule(radius=r, length=L, orientation=(0, np.pi / 2, 0))
    y = L / 2 * np.sin(angle) + r + 1e-6
    m.add(
        fb.Body(
            "rod",
            shape=shape,
            mass=M,
            inertia=J,
            position=(0, y),
            angle=angle,
            velocity=velocity,
            angular_velocity=spin,
        )
    )
    m.add(fb.Contact(friction=mu, restitution=e))
    return m


def routh(angle, velocity, spin, mu, e):
    """Impulses (t, n) by Routh's diagram: along the limit of friction till sliding ends, then along the line of no
    sliding (or on, where that is outside of the cone). Sliding does not turn round in the cases here."""
    r = -L / 2 * np.array([np.cos(angle), np.sin(angle)])
    N = np.array([[1 / M + r[1] ** 2 / J, -r[0] * r[1] / J], [-r[0] * r[1] / J, 1 / M + r[0] ** 2 / J]])
    u = np.array([velocity[0] - spin * r[1], velocity[1] + spin * r[0]])
    slide = np.array([-mu * np.sign(u[0]), 1.0])
    stick = np.array([-N[0, 1] / N[0, 0], 1.0])
    ends = -u[0] / (N @ slide)[0]  # p_n where sliding ends
    ends = ends if ends > 0 else np.inf

    def impulse(pn):
        return slide * min(pn, ends) + stick * max(0.0, pn - ends) if np.isfinite(ends) else slide * pn

    low, high = 0.0, 100.0  # p_n at the end of compression, where u_n = 0
    for _ in range(200):
        mid = (low + high) / 2
        low, high = (mid, high) if (u + N @ impulse(mid))[1] < 0 else (low, mid)
    p = impulse((1 + e) * low)
    assert p[1] <= ends or abs(stick[0]) <= mu
    return p, u, N


CASES = {
    "slides on": (0.8, (3.0, -1.0), 0.0, 0.1, 0.5),
    "sticks in compression": (0.9, (0.1, -1.0), 0.0, 0.8, 0.5),
    "sticks in expansion": (0.9, (0.75, -1.0), 0.3, 0.6, 0.8),
    "upright": (np.pi / 2 - 0.05, (0.2, -2.0), 0.0, 0.5, 1.0),
    "flat": (0.1, (0.3, -1.0), 0.5, 0.9, 0.7),
    "kane and levinson": (1.0, (2.0, -1.0), -1.0, 0.3, 0.9),
}


@pytest.mark.parametrize("case", CASES)
def test_as_routh_says(case):
    angle, velocity, spin, mu, e = CASES[case]
    m = rod(angle, velocity, spin, mu, e)
    run = m.simulate(1e-4, outputs=2, method=fb.Stepping(step=1e-5))
    p, u, N = routh(angle, velocity, spin, mu, e)
    got = M * (run["rod"].velocity[-1] - run["rod"].velocity[0])
    assert got == pytest.approx(p, rel=2e-3, abs=2e-4)
    assert run.energy.kinetic[-1] <= run.energy.kinetic[0] * (1 + 1e-12)


@pytest.mark.parametrize("law", ["poisson", "newton", "moreau"])
def test_no_law_makes_energy(law):
    """Newton's law with friction would, in a sixth of all cases here (Kane and Levinson, 1985)."""
    rng = np.random.default_rng(7)
    told = 0
    for _ in range(40):
        angle, mu, e = rng.uniform(0.2, 1.5), rng.uniform(0, 1.5), rng.uniform(0.3, 1)
        m = rod(angle, (rng.uniform(-4, 4), -1), rng.uniform(-3, 3), mu, e)
        run = m.simulate(1e-4, outputs=2, method=fb.Stepping(step=2e-5, restitution=law))
        assert run.energy.kinetic[-1] <= run.energy.kinetic[0] * (1 + 1e-9)
        told += any(law.title() in n for n in run.health.contact.warnings())
    assert told > 0 or law != "newton"
