"""A ball that bounces: heights, energy, and the time until it lies."""

import numpy as np
import pytest

import flyball as fb

from .contact_scenes import G, floor, stepped

LAWS = ("poisson", "newton", "moreau")


def ball(e, height=1.0, planar=False, **fields):
    """A ball of 2 kg and radius 0.1 m, so high above the floor."""
    m = floor(friction=0.3, restitution=e, planar=planar)
    shape = fb.Sphere(radius=0.1)
    at = (0, 0.1 + height) if planar else (0, 0, 0.1 + height)
    m.add(fb.Body("ball", shape=shape, mass=2, position=at, **fields))
    return m


def worst(e, step, law, planar=False):
    """Error of the heights of the first three bounces, in parts of the first height, from energies at their tops."""
    fall, up = np.sqrt(2 / G), 2 * e * np.sqrt(2 / G)
    times = [0.0, *(fall + up * (sum(e**k for k in range(n)) + e**n / 2) for n in range(3))]
    run = ball(e, planar=planar).simulate(times[-1], outputs=times, method=fb.Stepping(step=step, restitution=law))
    heights = (run.energy.total - run.energy.total[0]) / (2 * G) + 1
    return np.abs(heights[1:] - e ** (2 * np.arange(1, 4))).max()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("planar", [False, True])
def test_heights_are_squares_of_the_restitution(law, planar):
    """It turns round up to a step early: the error is below v h (1 - e^2), v = sqrt(2 g)."""
    for step in (4e-3, 1e-3, 2.5e-4):
        assert worst(0.7, step, law, planar) < np.sqrt(2 * G) * step * (1 - 0.7**2)


def test_it_lies_still_after_all_bounces():
    """They add up to sqrt(2 h / g) (1 + e) / (1 - e), of which what is left at a step's small speeds is missing."""
    e, step = 0.5, 1e-3
    time = np.sqrt(2 / G) * (1 + e) / (1 - e)
    run = stepped(ball(e), 2.0, step, outputs=2001)
    moves = run.t[np.abs(run["ball"].vz) > 1e-6]
    assert moves[-1] == pytest.approx(time, abs=10 * step)
    assert run["ball"].z[-1] == pytest.approx(0.1, abs=1e-9)
    assert np.abs(run.energy.balance).max() < 1e-11
    taken = run.exchanged["impact_loss"][-1], run.exchanged["numerical_loss"][-1]
    assert sum(taken) == pytest.approx(2 * G, rel=1e-6)
    assert taken[0] == pytest.approx(2 * G, rel=1e-5)


@pytest.mark.parametrize("law", LAWS)
def test_it_keeps_all_energy(law):
    """Restitution 1, twenty bounces of different lengths."""
    run = stepped(ball(1.0, 0.05), 4.0, 7e-3, outputs=101, restitution=law)
    assert run.energy.total == pytest.approx(run.energy.total[0], rel=1e-7)
    assert run["ball"].z.max() == pytest.approx(0.15, abs=2e-3)


def test_a_ball_that_spins_bounces_askew():
    """It sticks in the impact where friction is large, and leaves with 2/7 w r, rolling: Poisson's law holds no more.

    The point that is hit is between ball and floor, up to v h / 2 off the ball (of w, 10/7 as much in parts of it).
    """
    for step in (2e-3, 1e-3, 2.5e-4):
        m = ball(0.8, 1.0, angular_velocity=(0, 20, 0), velocity=(0, 0, 0))
        run = stepped(m, 0.7, step)["ball"]
        near = np.sqrt(2 * G) * step / 2 / 0.1
        assert run.vx[-1] == pytest.approx(2 / 7 * 2.0, rel=near)
        assert run.angular_velocity[-1] == pytest.approx([0, 2 / 7 * 20, 0], abs=2 / 7 * 20 * 1.5 * near)


BLOWS = [
    *((law, gap, "simultaneous") for law in LAWS for gap in (1e-6, 1e-4, 1e-3)),
    *(("poisson", gap, "sequential") for gap in (0.0, 1e-4)),  # one after the other they go by Poisson's law
]


@pytest.mark.parametrize(("law", "gap", "impacts"), BLOWS)
def test_blows_that_follow_within_a_step(gap, impacts, law):
    """Five equal balls in a row, 1 mm a step: each hands its speed on to the next however near that is."""
    m = fb.Mechanism("row", gravity=(0, 0, 0))
    m.add(fb.Contact(friction=0.0, restitution=1.0))
    for k in range(5):
        x, v = (-0.05, 1.0) if k == 0 else ((0.1 + gap) * k, 0.0)
        m.add(fb.Body(f"ball {k}", shape=fb.Sphere(radius=0.05), mass=1, position=(x, 0, 0), velocity=(v, 0, 0)))
    run = stepped(m, 0.3, 1e-3, restitution=law, impacts=impacts)
    assert [run[f"ball {k}"].vx[-1] for k in range(5)] == pytest.approx([0, 0, 0, 0, 1], abs=1e-9)
    assert run.energy.total[-1] == pytest.approx(0.5, rel=1e-9)


def exact_squeeze(light, heavy, gap, width, speed, span):
    """1-D elastic collisions of a point between a wall and a heavy body: (speeds of both, collisions, closest gap)."""
    x, u, L, w, t, hits, nearest = gap, 0.0, gap + width, -speed, 0.0, 0, gap + width
    while True:
        wall, body = x / -u if u < 0 else np.inf, (L - x) / (u - w) if u > w else np.inf
        dt = min(wall, body, span - t)
        x, L, t = x + u * dt, L + w * dt, t + dt
        nearest = min(nearest, L)
        if t >= span:
            return u, w, hits, nearest
        hits += 1
        if wall < body:
            x, u = 0.0, -u
        else:
            x, mean = L, (light * u + heavy * w) / (light + heavy)
            u, w = 2 * mean - u, 2 * mean - w


@pytest.mark.parametrize("joined", [False, True])
@pytest.mark.parametrize("step", [5e-3, 2e-4])
def test_a_light_ball_between_a_wall_and_a_heavy_body(step, joined):
    """Masses of 1 to 10000: some 300 collisions, between which the ball goes there and back; nothing is lost."""
    m = fb.Mechanism("squeeze")
    m.add(fb.Ground("wall", shape=fb.Plane(normal=(1, 0, 0))))
    m.add(fb.Body("ball", mass=1e-3, shape=fb.Sphere(radius=0.02), position=(0.07, 0, 0)))
    box = fb.Box(edges=(0.2, 0.2, 0.2))
    m.add(fb.Body("heavy", mass=10, shape=box, position=(0.24, 0, 0), velocity=(-1, 0, 0)))
    if joined:
        m.add(fb.Prismatic("rail", "ground", "heavy", at=(0.24, 0.5, 0), axis=(1, 0, 0)))
    m.add(fb.Contact(friction=0, restitution=1))
    run = stepped(m, 0.4, step, outputs=81)
    u, w, hits, nearest = exact_squeeze(1e-3, 10.0, 0.05, 0.05, 1.0, 0.4)
    assert hits > 300
    assert (run["heavy"].x - 0.1 - 0.04).min() > 0.9 * nearest  # it turns round early, by what it goes in a step
    assert run["ball"].x.min() > 0.02 - 1e-6
    assert run["heavy"].vx[-1] == pytest.approx(w, rel=1e-5)
    assert abs(run["ball"].vx[-1]) == pytest.approx(abs(u), rel=1e-2)
    assert run.energy.kinetic[-1] == pytest.approx(5.0, rel=1e-9)
    assert run.health.contact.worst_overlap < 1e-6 and not run.health.doubtful
