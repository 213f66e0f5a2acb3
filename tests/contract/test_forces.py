"""Every force element, found by registry: power = -dE/dt, and the same on any kind of number and anywhere."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball import forces
from flyball.constraints.switches.switch_kind import FROZEN, STATIC
from flyball.math.rotation import log_gradient, rotation_vector
from flyball.model.force import CoordinateForce
from flyball.testing.formula_checks import (
    complex_step_frame,
    frame_record,
    moved_frame,
    random_motion,
    turned_frame,
    wrench_power,
)

BETWEEN = [k for k in forces.ALL if not issubclass(k, CoordinateForce) and not k.takes_splines and hasattr(k, "wrench")]
"""Those given by curves, or with states of their own, are in `test_wheel_on_rail` and `test_tyres`."""
ALONG = [k for k in (*forces.ALL, *forces.LIMITS) if issubclass(k, CoordinateForce) and hasattr(k, "effort")]
LAWS = (1.0, -2.0, 0.5)
NO_LAWS = (0.0, 0.0, 0.0)
PARAMETERS = {
    "Bushing": (30.0, 50.0, 20.0, 1.0, 2.0, 0.5, 3.0, 7.0, 1.5, 0.2, 0.1, 0.4),
    "PointForce": (1.0,),
    "PointTorque": (1.0,),
    "SpringDamper": (30.0, 2.0, 0.4),
    "Actuator": (),
    "Backlash": (30.0, 2.0, 30.0, 2.0, -0.1, 0.1),
    "CoordinateSpring": (30.0, 2.0, 0.4),
    "Detent": (3.0, 20.0, 0.1, 0.2),
    "Limit": (30.0, 2.0, 70.0, 1.0, -0.1, 0.4),
    "Brake": (1.0, 1.2),
    "Clutch": (1.0, 1.2),
    "JointFriction": (0.7, 0.4, 0.3, 0.01, 0.001, 0.2, 1.0, 0.5, 2.0, 3.0, 1.0, 1.0),
    "Motor": (),
    "PathSpring": (30.0, 2.0, 0.4),
    "Rope": (30.0, 2.0, 0.4),
    "RotorInertia": (),
    "TorsionalSpringDamper": (30.0, 2.0, 0.4),
}
UNDAMPED = {  # of those that store energy and damp as well
    "Bushing": (*PARAMETERS["Bushing"][:3], 0.0, 0.0, 0.0, *PARAMETERS["Bushing"][6:9], 0.0, 0.0, 0.0),
    **dict.fromkeys(
        ("SpringDamper", "CoordinateSpring", "PathSpring", "Rope", "TorsionalSpringDamper"), (30.0, 0.0, 0.4)
    ),
    "Limit": (30.0, 0.0, 70.0, 0.0, -0.1, 0.4),
    "Backlash": (30.0, 0.0, 30.0, 0.0, -0.1, 0.1),
    "Detent": (3.0, 20.0, 0.1, 0.0),
}
COORDINATES = [-3.0, -0.2, 0.0, 0.35, 0.45, 12.0]

between = pytest.mark.parametrize("kind", BETWEEN, ids=lambda k: k.__name__)
along = pytest.mark.parametrize("kind", ALONG, ids=lambda k: k.__name__)
seeds = pytest.mark.parametrize("seed", range(4))


def padded(par):
    return (*par, *(0.0,) * (16 - len(par)))


def full(kind):
    return padded(PARAMETERS[kind.__name__])


def undamped(kind):
    return padded(UNDAMPED.get(kind.__name__, PARAMETERS[kind.__name__]))


def wrench(kind, par, F, M, laws=NO_LAWS, dtype=float):
    f, m = frame_record(F, dtype), frame_record(M, dtype)
    return kind.wrench(par, f, m, laws, kind.inputs(par, f, m))


def test_every_kind_has_its_cases():
    kinds = {*BETWEEN, *ALONG, *(k for k in forces.ALL if issubclass(k, CoordinateForce))}
    assert set(PARAMETERS) == {k.__name__ for k in kinds}
    assert set(UNDAMPED) <= {k.__name__ for k in kinds if k.energy is not None}


@between
@seeds
def test_power_between_frames_is_minus_the_rate_of_the_energy(kind, seed):
    """What a force without damping gives to the bodies it loses itself, far turned too; given forces store nothing."""
    F, M = random_motion(seed)
    if kind.energy is None:
        assert wrench_power(wrench(kind, full(kind), F, M), F, M) == pytest.approx(0.0, abs=1e-12)
        return
    P = wrench_power(wrench(kind, undamped(kind), F, M), F, M)
    e = 1e-30
    energy = kind.energy(
        undamped(kind), frame_record(complex_step_frame(F, e), complex), frame_record(complex_step_frame(M, e), complex)
    )
    assert pytest.approx(-np.imag(energy) / e, rel=1e-11, abs=1e-11) == P
    h = 1e-5
    ahead, behind = (
        kind.energy(undamped(kind), frame_record(moved_frame(F, s)), frame_record(moved_frame(M, s))) for s in (h, -h)
    )
    assert pytest.approx(-(ahead - behind) / (2 * h), rel=1e-6) == P


@along
def test_effort_is_minus_the_gradient_of_the_energy(kind):
    if kind.energy is None:
        assert kind.effort(full(kind), 0.3, 0.0, NO_LAWS, 5.0) == pytest.approx(0.0, abs=1e-15)
        return
    for x in COORDINATES:
        slope = np.imag(kind.energy(undamped(kind), complex(x, 1e-30))) / 1e-30
        assert kind.effort(undamped(kind), x, 7.0, NO_LAWS, 0.0) == pytest.approx(-slope, rel=1e-12, abs=1e-12)


@between
@seeds
def test_damping_between_frames_takes_power(kind, seed):
    F, M = random_motion(seed)
    P = wrench_power(wrench(kind, full(kind), F, M), F, M) - wrench_power(wrench(kind, undamped(kind), F, M), F, M)
    assert P < 0.0 if kind.__name__ in UNDAMPED else P == 0.0


@along
@pytest.mark.parametrize("rate", [-2.0, -1e-4, 1e-4, 2.0])
def test_damping_and_friction_along_a_coordinate_take_power(kind, rate):
    for x in COORDINATES:
        rest = kind.effort(full(kind), x, 0.0, NO_LAWS, 5.0)
        assert (kind.effort(full(kind), x, rate, NO_LAWS, 5.0) - rest) * rate <= 0.0


@between
@seeds
def test_inputs_are_a_quantity_and_its_rate(kind, seed):
    F, M = random_motion(seed)
    par, e = full(kind), 1e-30
    x = kind.inputs(
        par, frame_record(complex_step_frame(F, e), complex), frame_record(complex_step_frame(M, e), complex)
    )[0]
    assert kind.inputs(par, frame_record(F), frame_record(M))[1] == pytest.approx(np.imag(x) / e, rel=1e-12, abs=1e-14)


@between
@seeds
def test_nothing_depends_on_the_world(kind, seed):
    """The world turned and put 10 km away: the wrench turned with it, but for a force given in the world's axes."""
    F, M = random_motion(seed)
    Q, d = Rotation.random(random_state=3).as_matrix(), np.array([1e4, -2e3, 5e2])
    f, m = (turned_frame(x, Q, d) for x in (F, M))
    for here, there in zip(wrench(kind, full(kind), F, M, LAWS), wrench(kind, full(kind), f, m, LAWS), strict=True):
        assert np.array(there) == pytest.approx(Q @ np.array(here), rel=1e-9, abs=1e-9)


@between
def test_complex_numbers_and_arrays_change_nothing_between_frames(kind):
    frames = [random_motion(seed) for seed in range(3)]
    many = [
        tuple(
            tuple(np.array(x) for x in zip(*parts, strict=True))
            for parts in zip(*(frame_record(pair[side]) for pair in frames), strict=True)
        )
        for side in range(2)
    ]
    par = full(kind)
    arrays = kind.wrench(par, *many, LAWS, kind.inputs(par, *many))
    for k, (F, M) in enumerate(frames):
        real, other = wrench(kind, par, F, M, LAWS), wrench(kind, par, F, M, LAWS, complex)
        for a, b, c in zip(real, other, arrays, strict=True):
            assert np.asarray(b, complex) == pytest.approx(np.asarray(a, complex), rel=1e-13, abs=1e-13)
            assert [np.broadcast_to(x, 3)[k] for x in c] == pytest.approx(a, rel=1e-13, abs=1e-13)


@along
def test_complex_numbers_and_arrays_change_nothing_along_a_coordinate(kind):
    x = np.array(COORDINATES)
    rate = np.linspace(-1.0, 2.0, len(x))
    many = np.broadcast_to(kind.effort(full(kind), x, rate, LAWS, 5.0 + x * x), x.shape)
    for k in range(len(x)):
        one = kind.effort(full(kind), float(x[k]), float(rate[k]), LAWS, float(5.0 + x[k] ** 2))
        other = kind.effort(full(kind), complex(x[k]), complex(rate[k]), LAWS, complex(5.0 + x[k] ** 2))
        assert one == pytest.approx(many[k], rel=1e-14)
        assert complex(one) == pytest.approx(other, rel=1e-14)


@pytest.mark.parametrize("kind", [forces.Limit, forces.Backlash], ids=lambda k: k.__name__)
def test_an_elastic_stop_pushes_and_never_pulls(kind):
    par = padded((30.0, 2.0, 70.0, 1.0, -0.1, 0.4))
    assert kind.effort(par, -0.2, 0.0, NO_LAWS, 0.0) == pytest.approx(3.0)
    assert kind.effort(par, -0.2, -1.0, NO_LAWS, 0.0) == pytest.approx(5.0)
    assert kind.effort(par, -0.2, 5.0, NO_LAWS, 0.0) == 0.0, "it leaves faster than the stop springs back"
    assert kind.effort(par, 0.5, 1.0, NO_LAWS, 0.0) == pytest.approx(-8.0)
    assert kind.effort(par, 0.5, -9.0, NO_LAWS, 0.0) == 0.0
    assert kind.effort(par, 0.1, 9.0, NO_LAWS, 0.0) == 0.0, "between them nothing"


def test_frozen_a_side_goes_on_beyond_its_corner():
    par = padded((30.0, 2.0, 70.0, 1.0, -0.1, 0.4))
    for side, wanted in ((0.0, 0.0), (1.0, 30 * -0.2 - 2.0), (-1.0, -(70 * -0.3 + 1.0))):
        assert forces.Limit.effort(par, 0.1, 1.0, (0.0, 0.0, FROZEN + side), 0.0) == pytest.approx(wanted)
    rope = padded((30.0, 2.0, 0.4))
    assert forces.Rope.effort(rope, 0.5, -9.0, (0.0, 0.0, FROZEN - 1.0), 0.0) == pytest.approx(15.0)
    assert forces.Rope.effort(rope, 0.5, 0.0, (0.0, 0.0, FROZEN), 0.0) == 0.0


@pytest.mark.parametrize("rate", [-0.3, 1e-9, 2.0])
@pytest.mark.parametrize("way", [-1.0, 0.0, 1.0])
def test_friction_that_sticks_slides_the_way_it_is_told(rate, way):
    """By its switch, not by the sign of the rate; what is viscous goes by the rate. At rest static friction holds."""
    r, static, kinetic, viscous, preload, load = 0.7, 0.4, 0.3, 0.2, 1.0, 5.0
    par = padded((r, static, kinetic, 1.0, 1.0, viscous, preload, 0.5, 2.0, 3.0))
    effort = forces.JointFriction.effort
    slides = -r * kinetic * (load + preload) * way - viscous * rate
    assert effort(par, 0.1, rate, (0.0, 0.0, way), load) == pytest.approx(slides, rel=1e-14)
    held = effort(par, 0.1, 0.0, (0.0, 0.0, STATIC), load)
    assert abs(held) == pytest.approx(r * static * (load + preload), rel=1e-14)
    fall = padded((r, static, kinetic, 0.02, 1.0, viscous, preload, 0.5, 2.0, 3.0, 1.0))
    mu = kinetic + (static - kinetic) * np.exp(-((r * rate / 0.02) ** 2))
    slides = -r * mu * (load + preload) * way - viscous * rate
    assert effort(fall, 0.1, rate, (0.0, 0.0, way), load) == pytest.approx(slides, rel=1e-14)
    assert effort(fall, 0.1, 0.0, (0.0, 0.0, STATIC), load) == held


@pytest.mark.parametrize("kind", [forces.Clutch, forces.Brake])
def test_a_clutch_carries_its_capacity_and_holds_more(kind):
    par = full(kind)
    for way in (-1.0, 0.0, 1.0):
        assert kind.effort(par, 0.3, 5.0, (7.0, 0.0, way), 0.0) == -7.0 * way
    assert abs(kind.effort(par, 0.3, 0.0, (7.0, 0.0, STATIC), 0.0)) == pytest.approx(1.2 * 7.0)
    assert np.isnan(kind.effort(par, 0.3, 5.0, (-1e-9, 0.0, 1.0), 0.0)), "a negative capacity is no number"
    assert np.isnan(kind.effort(par, 0.3, 0.0, (-1e-9, 0.0, 0.0), 0.0)), "at rest too"


def test_a_rope_pulls_and_never_pushes():
    par = padded((30.0, 2.0, 0.4))
    rope = forces.Rope.effort
    assert rope(par, 0.5, 0.0, NO_LAWS, 0.0) == pytest.approx(-3.0)
    assert rope(par, 0.5, -1.0, NO_LAWS, 0.0) == pytest.approx(-1.0)
    assert rope(par, 0.5, -5.0, NO_LAWS, 0.0) == 0.0, "damping does not push either"
    assert rope(par, 0.3, 5.0, NO_LAWS, 0.0) == 0.0, "slack"
    assert forces.Rope.energy(par, 0.3) == 0.0


@pytest.mark.parametrize("angle", [1e-9, 9.9e-3, 1.01e-2, 0.5, 2.0, 3.1])
def test_rotation_vector_and_its_gradient(angle):
    """The logarithm of a rotation, and J^T a with thetadot = J omega by a complex step; near and above the series."""
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    R = Rotation.from_rotvec(angle * axis).as_matrix()
    theta = rotation_vector(tuple(R.ravel()))
    assert np.array(theta) == pytest.approx(angle * axis, rel=1e-12, abs=1e-15)
    a, e = (0.3, 1.0, -0.7), 1e-30
    slopes = []
    for w in np.eye(3):
        turn = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        ahead = rotation_vector(tuple(((np.eye(3) + 1j * e * turn) @ R).ravel().tolist()))
        slopes.append(np.dot(np.imag(ahead) / e, a))
    assert np.array(log_gradient(theta, a)) == pytest.approx(np.array(slopes), rel=1e-9, abs=1e-9)


def test_rotation_vector_says_nothing_at_half_a_turn():
    R = Rotation.from_rotvec((0.0, 0.0, np.pi - 1e-4)).as_matrix()
    assert np.isnan(rotation_vector(tuple(R.ravel()))).any()


@pytest.mark.parametrize("specialize", [False, True])
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_a_spring_without_free_length_at_its_anchor(coordinates, specialize):
    """F = -k r - c dr/dt along the line of motion: oscillations about the anchor and about m g / k below it."""
    w = np.sqrt(100.0 - 1.0)
    for damping, v, g in ((0.0, 0.0, -9.81), (2.0, 0.0, -9.81), (2.0, 3.0, 0.0), (0.0, 3.0, 0.0), (2.0, 0.0, 0.0)):
        m = fb.Mechanism("spring", planar=True, gravity=(0, g))
        m.add(fb.Body("b", mass=1, inertia=1, velocity=(0, v)))
        m.add(fb.SpringDamper("k", "ground", "b", at=((0, 0), (0, 0)), stiffness=100, length=0, damping=damping))
        run = m.simulate(1.0, outputs=21, coordinates=coordinates, specialize=specialize)
        t, d = run.t, damping / 2.0
        w = np.sqrt(100.0 - d * d)
        y = g / 100 * (1 - np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))) + v / w * np.exp(-d * t) * np.sin(
            w * t
        )
        np.testing.assert_allclose(run["b.y"], y, atol=2e-7)
        assert (run["k"].rate[0], run["k"].force[0]) == (v, damping * v)
        assert np.abs(run.energy.balance).max() < 1e-5


def test_small_oscillations_of_a_spring_without_free_length():
    """In any direction the same: s = -d +- i sqrt(k - d^2), for the motion along a line through the anchor."""
    m = fb.Mechanism("spring", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1))
    m.add(fb.SpringDamper("k", "ground", "b", at=((0, 0), (0, 0)), stiffness=100, length=0, damping=2))
    found = np.sort_complex(m.linearize().eigenvalues)
    w = 1j * np.sqrt(99)
    np.testing.assert_allclose(found, [-1 - w, -1 - w, -1 + w, -1 + w, 0, 0], atol=1e-9)


def test_a_spring_with_a_free_length_has_no_direction_at_its_anchor():
    m = fb.Mechanism("spring", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1))
    m.add(fb.SpringDamper("k", "ground", "b", at=((0, 0), (0, 0)), stiffness=100, length=0.1))
    with pytest.raises(fb.SimulationError, match=r"SpringDamper 'k'(?s:.*)points coincide(?s:.*)give length=0"):
        m.simulate(1.0)
