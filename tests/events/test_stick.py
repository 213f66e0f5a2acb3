"""Friction that sticks and slips, against closed forms: times, places, energies, and rest that is exactly rest."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers

G = 9.81
TIGHT = {"rtol": 1e-11, "atol": 1e-12}


def sled(planar=True, mass=2.0, stiffness=0.0, start=0.0, speed=0.0, **friction):
    """A block on a level rail through its mass centre, held by a spring; it rubs on the rail by its weight."""
    m = fb.Mechanism("sled", planar=planar, gravity=(0, -G) if planar else (0, -G, 0))
    axis, origin = ((1, 0), (0, 0)) if planar else ((1, 0, 0), (0, 0, 0))
    m.add(fb.Body("block", mass=mass, inertia=0.1 if planar else (0.1, 0.1, 0.1)))
    kind = fb.Translational if planar else fb.Prismatic
    m.add(kind("rail", "ground", "block", at=origin, axis=axis))
    if stiffness:
        m.add(fb.CoordinateSpring("spring", "rail.displacement", stiffness=stiffness))
    m.add(fb.Initial("rail.displacement", value=start, rate=speed))
    m.add(fb.JointFriction("rub", "rail", **friction))
    return m


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
@pytest.mark.parametrize(("kinetic", "start"), [(0.2, 1.0), (0.15, -0.93), (0.2, 0.117), (0.2, 0.0971)])
def test_coulomb_oscillator(planar, kinetic, start):
    """Each half swing takes pi / w and 2 mu_k m g / k of the amplitude, until mu_s m g holds what is left."""
    mass, k, static = 2.0, 40.0, 0.2
    d, hold, w = kinetic * mass * G / k, static * mass * G / k, math.sqrt(k / mass)
    swings = 0
    while abs(start) - 2 * d * swings > hold:
        swings += 1
    left = (-1) ** swings * (abs(start) - 2 * d * swings) * math.copysign(1.0, start)
    m = sled(planar, mass, k, start, static=static, kinetic=kinetic)
    r = m.simulate((swings + 1) * math.pi / w, outputs=401, **TIGHT)
    reference = np.empty_like(r.t)
    for i, t in enumerate(r.t):
        n = min(int(t * w / math.pi), swings)
        side = (-1) ** n * math.copysign(1.0, start)
        middle, swing = side * d, side * (abs(start) - (2 * n + 1) * d)
        reference[i] = left if n == swings else middle + swing * math.cos(w * t - n * math.pi)
    assert r["rail"].displacement == pytest.approx(reference, abs=1e-8)
    late = r.t > swings * math.pi / w * (1 + 1e-6)
    assert at_rest(r["rail"], late)
    assert r["rub"].friction[late] == pytest.approx(np.full(late.sum(), k * left), abs=1e-7)
    way = sum(2 * (abs(start) - (2 * n + 1) * d) for n in range(swings))
    assert r["rub"].work[-1] == pytest.approx(-kinetic * mass * G * way, abs=1e-8)
    assert r.health.energy_drift < 1e-8
    assert r.health.creep == {}


def at_rest(joint, when):
    """Whether it does not move at all, but for rounding."""
    return np.abs(joint.rate[when]).max() < 1e-14 and np.ptp(joint.displacement[when]) < 1e-14


def changes(r):
    """Times at which something sticks or slips, those of the start apart."""
    return [e.t for e in r.events if e.t > 0.0]


def on_belt(static, kinetic, speed, k, mass=1.0):
    """A block on a belt, tied to the wall by a spring."""
    m = fb.Mechanism("belt", planar=True, gravity=(0, -G))
    m.add(fb.Body("belt", mass=1.0, inertia=1.0), fb.Body("block", mass=mass, inertia=0.1))
    m.add(fb.Translational("bed", "ground", "belt", at=(0, 0), axis=(1, 0)))
    m.add(fb.Translational("top", "belt", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("run", "bed.displacement", law=f"{speed}*t"))
    m.add(fb.CoordinateSpring("spring", "block.x", stiffness=k))
    m.add(fb.JointFriction("rub", "top", static=static, kinetic=kinetic))
    return m


@pytest.mark.parametrize(("static", "kinetic", "speed"), [(0.4, 0.25, 0.2), (0.5, 0.1, 1.0)])
def test_stick_slip_on_a_belt(static, kinetic, speed):
    """It goes with the belt until k x = mu_s N, slips for 2 (pi - atan(A w / v)) / w, then sticks for 2 A / v.

    A = (mu_s - mu_k) N / k; slipping is a swing about mu_k N / k.
    """
    k, mass = 50.0, 1.0
    N, w = mass * G, math.sqrt(k / mass)
    A = (static - kinetic) * N / k
    slip, stick = 2 * (math.pi - math.atan(A * w / speed)) / w, 2 * A / speed
    first = static * N / k / speed
    m = on_belt(static, kinetic, speed, k)
    # at rest beside a belt that moves it slips first: let it begin with the belt
    m.add(fb.Initial("block.x", value=0.0, rate=speed))
    r = m.simulate(first + 2.5 * (slip + stick), outputs=501, **TIGHT)
    times = [first + n * (slip + stick) + d for n in range(3) for d in (0.0, slip)]
    assert changes(r)[:6] == pytest.approx([t for t in times if t < r.t[-1]][:6], abs=1e-8)
    x = np.empty_like(r.t)
    for i, t in enumerate(r.t):
        n, s = divmod(t - first, slip + stick)
        if n < 0:
            x[i] = speed * t
        elif s < slip:
            x[i] = kinetic * N / k + A * math.cos(w * s) + speed / w * math.sin(w * s)
        else:
            x[i] = kinetic * N / k - A + speed * (s - slip)
    assert r["block"].x == pytest.approx(x, abs=1e-8)
    stuck = np.abs(r["top"].rate) < 1e-14
    assert stuck.sum() > 50
    assert r["rub"].friction[stuck] == pytest.approx(k * x[stuck], abs=1e-6)
    assert r.health.energy_drift < 1e-8


@pytest.mark.parametrize("planar", [True, False], ids=["plane", "space"])
def test_flywheel_braked_to_rest(planar):
    """W J / M until it stands, after w^2 J / 2 M; then it does not move at all."""
    m = fb.Mechanism("flywheel", planar=planar)
    m.add(fb.Body("wheel", mass=3.0, inertia=0.5 if planar else (0.3, 0.3, 0.5)))
    m.add(
        fb.Revolute(
            "axle", "ground", "wheel", at=(0, 0) if planar else (0, 0, 0), **({} if planar else {"axis": (0, 0, 1)})
        )
    )
    m.add(fb.Brake("brake", "axle.angle", capacity="2 N*m"))
    m.add(fb.Initial("axle.angle", value=0.0, rate=12.0))
    r = m.simulate(5.0, outputs=51, **TIGHT)
    assert changes(r) == pytest.approx([12.0 * 0.5 / 2.0], abs=1e-9)
    late = r.t > 3.0 + 1e-6
    assert np.abs(r["axle"].rate[late]).max() < 1e-14
    assert r["axle"].angle[late] == pytest.approx(np.full(late.sum(), 144.0 * 0.5 / 4.0), abs=1e-9)
    assert np.ptp(r["axle"].angle[late]) < 1e-14
    assert r["brake"].friction[late] == pytest.approx(np.zeros(late.sum()), abs=1e-12)
    assert r["brake"].work[-1] == pytest.approx(-0.5 * 0.5 * 144.0, rel=1e-9)


def test_block_on_a_tilting_plane_slips_at_the_angle_of_friction():
    """At tan(angle) = mu_s; from there x'' = g sin a + w^2 x - mu_k (g cos a - 2 w x')."""
    static, kinetic, w = 0.5, 0.4, 0.3
    m = fb.Mechanism("tilt", planar=True, gravity=(0, -G))
    m.add(fb.Body("plane", mass=5.0, inertia=1.0), fb.Body("block", mass=2.0, inertia=0.05))
    m.add(fb.Revolute("hinge", "ground", "plane", at=(0, 0)))
    m.add(fb.Translational("slope", "plane", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("tilt", "hinge.angle", law=f"-{w}*t"))
    m.add(fb.JointFriction("rub", "slope", static=static, kinetic=kinetic))
    r = m.simulate(2.2, outputs=45, **TIGHT)
    slips = math.atan(static) / w
    assert changes(r) == pytest.approx([slips], abs=1e-8)
    assert np.abs(r["slope"].displacement[r.t < slips]).max() < 1e-14

    def moves(t, y):
        # the axis turns by -w t, so the block's own coordinate is down the slope; Coriolis lifts or presses it
        a = w * t
        N = G * math.cos(a) - 2 * w * y[1]
        return y[1], G * math.sin(a) + w * w * y[0] - kinetic * N

    after = r.t[r.t > slips]
    found = solve_ivp(moves, (slips, r.t[-1]), [0, 0], t_eval=after, rtol=1e-12, atol=1e-13, method="DOP853")
    assert r["slope"].displacement[r.t > slips] == pytest.approx(found.y[0], abs=1e-8)
    assert r["slope"].rate[r.t > slips] == pytest.approx(found.y[1], abs=1e-8)


def wedge(angle, mu, force, load=20.0):
    """A wedge on a level bed lifts a follower on an upright guide; only the slope between them rubs."""
    m = fb.Mechanism("wedge", planar=True, gravity=(0, 0))
    m.add(fb.Body("wedge", mass=3.0, inertia=0.1), fb.Body("follower", mass=2.0, inertia=0.1))
    m.add(fb.Translational("bed", "ground", "wedge", at=(0, 0), axis=(1, 0)))
    m.add(fb.Translational("guide", "ground", "follower", at=(0, 0), axis=(0, 1)))
    m.add(fb.PinInSlot("slope", "wedge", "follower", at=(0, 0), axis=(math.cos(angle), -math.sin(angle))))
    m.add(fb.PointForce("load", "follower", force=(0, -load)))
    m.add(fb.Actuator("push", "bed.displacement", force=force))
    m.add(fb.JointFriction("rub", "slope", coordinate="displacement", static=mu))
    return m


@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_wedge_lifts_lowers_and_locks_itself(mu):
    """It moves in at F = W tan(angle + phi), out at W tan(angle - phi): never by itself where phi > angle."""
    angle, load, rise = 0.2, 20.0, 4.0
    phi = math.atan(mu)
    inwards = wedge(angle, mu, f"{load * math.tan(angle)} + {rise}*t").simulate(4.0, outputs=41, **TIGHT)
    slips = load * (math.tan(angle + phi) - math.tan(angle)) / rise
    assert changes(inwards) == pytest.approx([slips], abs=1e-8)
    assert np.abs(inwards["bed"].displacement[inwards.t < slips]).max() < 1e-14
    assert inwards["follower"].y[-1] > 0.1
    out = wedge(angle, mu, f"{load * math.tan(angle)} - {rise}*t").simulate(4.0, outputs=41, **TIGHT)
    slips = load * (math.tan(angle) - math.tan(angle - phi)) / rise
    assert changes(out) == pytest.approx([slips], abs=1e-8)
    left = wedge(angle, mu, "0").simulate(1.0, outputs=11)
    assert np.abs(left["follower"].y).max() < 1e-14 if phi > angle else left["follower"].y[-1] < -0.03


def test_wedge_accelerates_by_friction_of_its_own_load():
    """Two bodies, one freedom: with N on the slope, F - N (sin + mu cos) = M a and N (cos - mu sin) - W = m a tan."""
    angle, mu, force = 0.3, 0.25, 40.0
    r = wedge(angle, mu, str(force)).simulate(0.2, outputs=5, **TIGHT)
    s, c, T = math.sin(angle), math.cos(angle), math.tan(angle)
    A = np.array([[3.0, s + mu * c], [2.0 * T, -(c - mu * s)]])
    a, N = np.linalg.solve(A, [force, -20.0])
    assert r["bed"].acceleration == pytest.approx(np.full(5, a), rel=1e-9)
    assert np.abs(r["rub"].friction) == pytest.approx(np.full(5, mu * N), rel=1e-9)


def test_velocity_reverses_without_a_rest():
    """A force that outweighs friction at the turn: it decelerates by F + mu N, and goes back by F - mu N."""
    m = sled(static=0.3, kinetic=0.2, speed=2.0)
    m.add(fb.Actuator("pull", "rail.displacement", force=-20.0))
    r = m.simulate(1.0, outputs=101, **TIGHT)
    there, back = 10.0 + 0.2 * G, 10.0 - 0.2 * G
    turn = 2.0 / there
    x = np.where(r.t < turn, 2.0 * r.t - there * r.t**2 / 2, 2.0 / there - back * (r.t - turn) ** 2 / 2)
    x += np.where(r.t < turn, 0.0, 2.0 * turn - there * turn**2 / 2 - 2.0 / there)
    assert r["rail"].displacement == pytest.approx(x, abs=1e-9)


def test_stribeck_and_viscous_friction_while_it_slides():
    """It sticks by mu_s; sliding, mu falls with the speed and c v adds to it."""
    m = sled(speed=3.0, static=0.4, kinetic=0.1, stribeck_speed=0.5, viscous=0.7, preload=3.0)
    m.add(fb.Actuator("pull", "rail.displacement", force="where(t < 3, 0, 4*(t - 3))"))
    r = m.simulate(8.0, outputs=161, **TIGHT)
    N = 2.0 * G + 3.0

    def law(v):
        return (0.1 + 0.3 * math.exp(-((v / 0.5) ** 2))) * N + 0.7 * v

    def rests(t, y):
        return y[1]

    rests.terminal = True
    found = solve_ivp(
        lambda t, y: (y[1], -law(y[1]) / 2.0), (0, 3), [0, 3.0], events=rests, rtol=1e-12, atol=1e-13, method="DOP853"
    )
    slips = 3.0 + 0.4 * N / 4.0
    assert changes(r) == pytest.approx([found.t[-1], slips], abs=1e-8)
    stuck = (r.t > found.t[-1] + 1e-6) & (r.t < slips)
    assert r["rail"].displacement[stuck] == pytest.approx(np.full(stuck.sum(), found.y[0, -1]), abs=1e-8)
    assert np.ptp(r["rail"].displacement[stuck]) < 1e-14
    sliding = r.t > slips + 1e-3
    expected = [-law(v) for v in r["rail"].rate[sliding]]
    assert r["rub"].friction[sliding] == pytest.approx(expected, rel=1e-9)


def shaken(seed, **law):
    """A sled on a spring, and a pendulum on it: both rub, the hinge by the load of a swinging bob; a force shakes them."""
    rng = np.random.default_rng(seed)
    m = fb.Mechanism("shaken", planar=True, gravity=(0, -G))
    m.add(fb.Body("sled", mass=2.0, inertia=0.1), fb.Body("bob", mass=1.0, inertia=0.02, position=(0.0, -0.5)))
    m.add(fb.Translational("rail", "ground", "sled", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("hinge", "sled", "bob", at=(0, 0)))
    m.add(fb.CoordinateSpring("spring", "rail.displacement", stiffness=rng.uniform(50, 200)))
    w, F = rng.uniform(2, 9), rng.uniform(5, 20)
    m.add(fb.Actuator("shake", "rail.displacement", force=f"{F}*sin({w}*t)"))
    m.add(fb.Initial("hinge.angle", value=rng.uniform(-1, 1), rate=rng.uniform(-2, 2)))
    mu = rng.uniform(0.1, 0.3, 2)
    m.add(fb.JointFriction("slides", "rail", static=mu[0], **law))
    m.add(fb.JointFriction("turns", "hinge", static=mu[1], radius=0.1, **law))
    return m


@pytest.mark.parametrize("seed", range(3))
def test_the_regularised_law_tends_to_it(seed):
    """As its stick speed goes to nothing, motion and works do; with it by so many metres."""
    true = shaken(seed).simulate(2.0, outputs=41, rtol=1e-9, atol=1e-10)
    assert {name for e in true.events for name in e.name.split(", ")} == {"slides", "turns"}
    gaps = []
    for v in (1e-3, 1e-5):
        r = shaken(seed, stick_speed=v).simulate(2.0, outputs=41, rtol=1e-8, atol=1e-10)
        gaps.append(max(np.abs(r[j] - true[j]).max() for j in ("rail.displacement", "hinge.angle")))
        assert r["turns"].work[-1] == pytest.approx(true["turns"].work[-1], rel=300 * v + 1e-5)
    assert gaps[1] < 1e-4
    assert gaps[1] < 0.1 * gaps[0]


@pytest.mark.parametrize(
    ("law", "way"), [("step5(t, 0, 0, 1, 0.5)", 0.5), ("0.3*sin(4*t)", 0.6 - 0.3 * math.sin(4.0)), ("0", 0.0)]
)
def test_friction_on_a_coordinate_that_a_driver_moves(law, way):
    """The driver carries it, against the rate, and nothing where it rests; there is nothing to hold."""
    m = sled(static=0.3)
    m.add(fb.Driver("drive", "rail.displacement", law=law))
    m.initial = []
    m.add(fb.Body("bob", mass=1.0, inertia=0.1, position=(0, -0.5)), fb.Sensor("pace", "rail.rate"))
    m.add(fb.Fixed("held", "ground", "bob", at=(0, -0.5)))
    r = m.simulate(1.5 if "step5" in law else 1.0, outputs=31, **TIGHT)
    moves = np.abs(r["rail"].rate) > 1e-6
    assert r["rub"].friction[moves] == pytest.approx(-0.3 * 2.0 * G * np.sign(r["rail"].rate[moves]), rel=1e-9)
    assert (r["rub"].friction[r["rail"].rate == 0.0] == 0.0).all()
    assert r["rub"].work[-1] == pytest.approx(-0.3 * 2.0 * G * way, rel=1e-8)
