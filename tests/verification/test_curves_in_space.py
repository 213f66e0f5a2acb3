"""Points that follow curves in space: closed forms of motion, reaction, position; ends, laps, equations, refusals."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

G = 9.81
R, PITCH = 0.4, 0.15
C = PITCH / (2 * np.pi)
HELIX = {"formulas": ("R*cos(u)", "R*sin(u)", "-pitch*u/(2*pi)"), "interval": (0, "8*pi")}


def helix(**more):
    m = fb.Mechanism("helix", gravity=(0, 0, -G), parameters={"R": R, "pitch": PITCH})
    m.add(fb.Body("bead", mass=0.3, inertia=0, position=(R, 0, 0)))
    m.add(fb.PointOnCurve("wire", "ground", "bead", at=(R, 0, 0), **(HELIX | more)))
    return m


@both_layers
def test_bead_on_a_helix():
    """Constant acceleration g c / sqrt(R^2 + c^2) along the wire; the reaction is that of Newton's law."""
    r = helix().simulate(1.5, outputs=16, rtol=1e-9)
    slope = C / np.hypot(R, C)
    s = 0.5 * G * slope * r.t**2
    assert r["wire.position"] == pytest.approx(s, rel=1e-6, abs=1e-9)
    assert r["wire.position_rate"] == pytest.approx(G * slope * r.t, rel=1e-6)
    assert r["wire.position_acceleration"] == pytest.approx(np.full(16, G * slope), abs=1e-5)
    u = s / np.hypot(R, C)
    assert r["bead"].position == pytest.approx(np.stack([R * np.cos(u), R * np.sin(u), -C * u], axis=1), abs=1e-6)
    needed = 0.3 * (r["bead"].acceleration + np.array([0, 0, G]))
    assert r["wire"].force == pytest.approx(needed, abs=1e-9)
    assert r.energy.balance == pytest.approx(np.zeros(16), abs=1e-8)


def circle(**more):
    """A closed curve through 80 points, in an inclined plane."""
    u = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    points = np.stack([np.cos(u), 0.8 * np.sin(u), 0.6 * np.sin(u)], axis=1)
    m = fb.Mechanism("ring", gravity=(0, 0, -G))
    m.add(fb.Body("bead", mass=0.3, inertia=0, position=(1, 0, 0), velocity=(0, 8, 6)))
    m.add(fb.PointOnCurve("ring", "ground", "bead", at=(1, 0, 0), points=points, closed=True, **more))
    return m


@pytest.mark.parametrize("method", ["auto", "radau"])
def test_laps_of_a_closed_curve(method):
    """Laps of a circle of radius 1: position counts them; v^2 = v0^2 - 2 g z."""
    r = circle().simulate(3.0, outputs=61, method=method, rtol=1e-8)
    s = r["ring.position"]
    assert s[-1] > 3 * 2 * np.pi
    assert r["bead.z"] == pytest.approx(0.6 * np.sin(s), abs=1e-4)
    assert r["ring.position_rate"] ** 2 == pytest.approx(100 - 2 * G * r["bead.z"], rel=1e-6)
    assert r["ring.position_rate"] == pytest.approx(np.linalg.norm(r["bead"].velocity, axis=1), rel=1e-6)


def test_drivers_springs_and_limits_act_along_it():
    m = circle()
    m.gravity = (0, 0, 0)
    m.add(fb.Driver("drive", "ring.position", "0.5 + 0.3*t**2"))
    r = m.kinematics(np.linspace(0, 6, 7))
    assert r["ring.position"] == pytest.approx(0.5 + 0.3 * r.t**2, abs=1e-9)
    assert r["drive.effort"] == pytest.approx(np.full(7, 0.3 * 0.6), rel=5e-4)
    spring = helix()
    spring.add(fb.CoordinateSpring("spring", "wire.position", stiffness=5.0))
    rest = spring.equilibrium()
    slope = C / np.hypot(R, C)
    assert 5.0 * rest["wire.position"] == pytest.approx(0.3 * G * slope, rel=1e-6)
    modes = spring.modes(about=rest)
    assert np.abs(modes.eigenvalues).max() == pytest.approx(np.sqrt(5.0 / 0.3), rel=1e-5)
    stop = helix()
    stop.add(fb.Limit("stop", "wire.position", upper=0.1))
    assert stop.simulate(2.0, outputs=3)["wire.position"][-1] == pytest.approx(0.1, abs=1e-9)


def test_curve_on_a_moving_body_in_the_plane():
    """A bead on a parabola fixed on a cart that is accelerated: it rests where the slope is -a / g."""
    m = fb.Mechanism("cart", planar=True, gravity=(0, -G))
    m.add(fb.Body("cart", mass=5.0, inertia=1.0), fb.Body("bead", mass=0.1, inertia=0.001, position=(0, 0)))
    m.add(
        fb.Translational("rail", "ground", "cart", at=(0, 0), axis=(1, 0)), fb.Driver("a", "rail.displacement", "t**2")
    )
    x = np.linspace(-1, 1, 41)
    m.add(fb.PointOnCurve("bowl", "cart", "bead", at=(0, 0), points=np.stack([x, x**2], axis=1)))
    m.add(fb.PointTorque("hold", "bead", torque=0))
    m.add(fb.SpringDamper("damper", "cart", "bead", at=((0, 0), (0, 0)), damping=0.5, length=0, stiffness=1e-9))
    r = m.simulate(20.0, outputs=3)
    lag = r["bead.x"][-1] - r["cart.x"][-1]
    assert 2 * lag == pytest.approx(-2.0 / G, rel=1e-3)


def test_end_of_the_curve_is_named():
    with pytest.raises(fb.SimulationError, match=r"'wire' is at an end of the curve, position 10\.0[0-9]* m"):
        helix().simulate(20.0)
    outside = {"formulas": ("u", "0", "0"), "interval": (0, 1)}
    m = helix()
    m.add(fb.Body("b", mass=1, inertia=0))
    with pytest.raises(fb.ModelError, match="beyond an end of the curve"):
        m.add(fb.PointOnCurve("rod", "ground", "b", at=(2, 0, 0), **outside))


def test_symbolic_equations_and_parameters():
    plain = helix(formulas=("0.4*cos(u)", "0.4*sin(u)", "-0.1*u"))
    assert list(plain.symbolic().places) == ["wire.place"]
    m = helix()
    with pytest.raises(fb.ModelError, match="give these parameters as numbers"):
        m.symbolic()
    s = m.sensitivity(of=["bead.z"], to=["pitch"], analysis="motion", t_end=0.8, outputs=2)

    def z(pitch):
        c = pitch / (2 * np.pi)
        return -c * 0.5 * G * c / (R**2 + c**2) * 0.64

    exact = (z(PITCH + 1e-5) - z(PITCH - 1e-5)) / 2e-5
    assert np.ravel(s["bead.z", "pitch"])[-1] == pytest.approx(exact, rel=1e-5)


def test_mobility_and_file(tmp_path):
    m = helix()
    assert m.mobility().freedoms == 1
    m.save(tmp_path / "helix.toml")
    assert fb.load(tmp_path / "helix.toml") == m


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, "give either points"),
        ({"formulas": ("u", "u", "0")}, "formulas need interval"),
        ({"formulas": ("u", "u/0", "0"), "interval": (0, 1)}, "finite"),
        ({"formulas": ("u", "v", "0"), "interval": (0, 1)}, "unknown name 'v'"),
        ({"points": [(0, 0, 0), (1, 0, 0), (1, 0, 0), (2, 0, 0)]}, "points 1 and 2 of its curve coincide"),
        ({"points": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 0, 0)], "closed": True}, "does not repeat its first point"),
        ({"points": [(0, 0, 0), (1, 0, 0), (1, 1, 0)]}, "four points or more"),
    ],
)
def test_refused(fields, message):
    m = fb.Mechanism("bad")
    m.add(fb.Body("b", mass=1, inertia=0))
    with pytest.raises(fb.ModelError, match=message):
        m.add(fb.PointOnCurve("c", "ground", "b", at=(0, 0, 0), **fields))


def test_friction():
    """In the plane a bead on a straight wire at 30 deg slides with g (sin - mu cos); in space it is refused."""
    tilt, mu = np.radians(30), 0.2
    m = fb.Mechanism("slope", planar=True, gravity=(0, -G))
    m.add(fb.Body("bead", mass=0.3, inertia=0, position=(0, 0)))
    points = [(s * np.cos(tilt), -s * np.sin(tilt)) for s in np.linspace(0, 3, 7)]
    m.add(fb.PointOnCurve("wire", "ground", "bead", at=(0, 0), points=points))
    m.add(fb.JointFriction("rub", "wire", coordinate="position", static=mu))
    r = m.simulate(1.0, outputs=6, rtol=1e-9)
    a = G * (np.sin(tilt) - mu * np.cos(tilt))
    assert r["wire.position"] == pytest.approx(0.5 * a * r.t**2, abs=1e-8)
    with pytest.raises(fb.ModelError, match="friction along a curve in space"):
        helix().add(fb.JointFriction("rub", "wire", coordinate="position", static=mu))


def test_couplings_name_its_position():
    """A bead on a wire winds a drum: (m + J / r^2) s'' = m g times the slope, and the sum keeps its reference value."""
    m = helix()
    m.add(fb.Body("drum", mass=1, inertia=(0.01, 0.01, 0.002)))
    m.add(fb.Revolute("A", "ground", "drum", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Coupler("rope", ("wire.position", "A.angle"), weights=(1, "-0.1 m/rad")))
    r = m.simulate(1.0, outputs=6, rtol=1e-9)
    force = 0.3 * G * C / np.hypot(R, C)
    assert r["wire.position"] == pytest.approx(0.5 * force / (0.3 + 0.002 / 0.01) * r.t**2, rel=1e-5, abs=1e-8)
    assert r["A.angle"] == pytest.approx(10 * r["wire.position"], abs=1e-9)
