"""Hydraulic cylinders against closed forms: the law of cosines, levers, pins that carry the force."""

import numpy as np
import pytest

import flyball as fb
from flyball.errors import AnalysisError, ModelError
from flyball.model.model_files import dumps, loads

MASS, INERTIA, REACH, FOOT, G = 10.0, 1.0, 1.0, 1.2, 9.81
ENDS = ((0.0, -FOOT), (REACH, 0.0))
RODS = {
    "barrel": fb.Rod(start=(0, 0), end=(0.8, 0), radius=0.05, mass=3),
    "rod": fb.Rod(start=(0, 0), end=(0.9, 0), radius=0.03, mass=2),
}


def boom(*more, gravity=G, **fields):
    """A boom on a hinge at the origin, level as drawn, with a cylinder from a point below to its mass centre."""
    m = fb.Mechanism("boom", planar=True, gravity=(0, -gravity), parameters={"k": 3000.0})
    m.add(fb.Body("arm", mass=MASS, inertia=INERTIA, position=(REACH, 0)), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    m.add(fb.LinearActuator("C", "ground", "arm", at=ENDS, **fields), *more)
    return m


def length_at(angle):
    """Law of cosines."""
    return np.sqrt(FOOT**2 + REACH**2 + 2.0 * FOOT * REACH * np.sin(angle))


def lever(angle):
    """Rate of the length per rate of the angle."""
    return FOOT * REACH * np.cos(angle) / length_at(angle)


LAWS = {
    "driven": {"length": f"{length_at(0.0)} + 0.2*sin(3*t)"},
    "masses": {"length": f"{length_at(0.0)} + 0.2*sin(3*t)"} | RODS,
}


def test_driven_length_follows_its_law_and_the_effort_balances_the_boom():
    r = boom(**LAWS["driven"]).simulate(1.0, outputs=np.linspace(0, 1, 51))
    length = length_at(0.0) + 0.2 * np.sin(3.0 * r.t)
    assert r["C.length"] == pytest.approx(length, abs=1e-10)
    angle = np.arcsin((length**2 - FOOT**2 - REACH**2) / (2.0 * FOOT * REACH))
    assert r["A.angle"] == pytest.approx(angle, abs=1e-9)
    torque = (INERTIA + MASS * REACH**2) * r["A"].angle_acceleration + MASS * G * REACH * np.cos(angle)
    assert r["C_drive.effort"] == pytest.approx(torque / lever(angle), rel=1e-8)
    work = r["energy.total"] - r["energy.total"][0]
    assert r["C_drive.work"] == pytest.approx(work, abs=1e-6)


def test_pins_carry_the_force_of_a_cylinder_with_masses():
    """The force at the foot along the line, less the share of the two weights and inertias, is the drive's."""
    m = boom(gravity=0.0, length=f"{length_at(0.0)} + 0.001*t", **RODS)
    m.add(fb.PointForce("load", "arm", force=(0, -500)))
    r = m.simulate(0.01)
    assert r["C_drive.effort"][0] == pytest.approx(500.0 * REACH / lever(0.0), rel=1e-3)
    assert r["C.length"] == pytest.approx(r["C_slide.displacement"], abs=1e-12)
    at_foot = np.hypot(r["C_foot.fx"][0], r["C_foot.fy"][0])
    assert at_foot == pytest.approx(r["C_drive.effort"][0], rel=1e-3), "the foot carries the thrust"
    without = boom(fb.PointForce("load", "arm", force=(0, -500)), gravity=0.0, length=f"{length_at(0.0)} + 0.001*t")
    assert without.simulate(0.01)["C_drive.effort"][0] == pytest.approx(r["C_drive.effort"][0], rel=1e-3)


def test_masses_follow_expressions_and_units_of_their_ends():
    m = fb.Mechanism("units", planar=True, gravity=(0, 0), parameters={"L": "100 cm"})
    m.add(fb.Body("arm", mass=1, inertia=1, position=("L", 0)), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    m.add(fb.LinearActuator("C", "ground", "arm", at=((0, "-1.2*L"), ("100 cm", 0)), force=0, **RODS))
    r = m.simulate(0.01)
    assert r["C.length"] == pytest.approx(length_at(0.0), abs=1e-12)
    assert r["C_barrel.angle"] == pytest.approx(np.arctan2(FOOT, REACH), abs=1e-12)


def test_spring_force_in_equilibrium_modes_and_sensitivity():
    """k (rest - length) pushes against the weight; the frequency of small motions follows from the potential."""
    rest = length_at(0.0) + MASS * G * REACH / (3000.0 * lever(0.0))
    m = boom(force=f"k*({float(rest)!r} - value)")
    e = m.equilibrium()
    assert e["A.angle"] == pytest.approx(0.0, abs=1e-9)
    step = 1e-4

    def energy(a):
        return MASS * G * REACH * np.sin(a) + 0.5 * 3000.0 * (length_at(a) - rest) ** 2

    stiffness = (energy(step) - 2.0 * energy(0.0) + energy(-step)) / step**2
    frequency = np.sqrt(stiffness / (INERTIA + MASS * REACH**2))
    assert m.modes(about=e).omega[0] == pytest.approx(frequency, rel=1e-6)
    assert m.linearize(about=e, inputs=["C_drive"], outputs=["C.length"]).B[-1, 0] == pytest.approx(
        lever(0.0) / (INERTIA + MASS * REACH**2), rel=1e-9
    )
    m.add(fb.Initial("A.angle", value=0.1))
    found = m.sensitivity(["C.length"], ["k"], analysis="motion", t_end=0.5)
    low, high = (m.simulate(0.5, parameters={"k": 3000.0 + d})["C.length"][-1] for d in (-1, 1))
    assert found["C.length", "k"][-1] == pytest.approx((high - low) / 2.0, rel=1e-4)


def test_stroke_ends_brake_and_lock():
    m = boom(fb.Limit("stroke", "C.length", lower=1.4, upper=1.6))
    r = m.simulate(1.0)
    assert r["C.length"].min() > 1.4 - 1e-9
    assert r["C.length"][-1] == pytest.approx(1.4, abs=1e-9)
    angle = r["A.angle"][-1]
    assert r["stroke.force"][-1] == pytest.approx(MASS * G * REACH * np.cos(angle) / lever(angle), rel=1e-9)
    locked = boom(fb.Event("valve", "t > 0.1", do=[fb.Lock("C")])).simulate(0.3)
    angle = locked["A.angle"][-1]
    assert locked["C.length_effort"][-1] == pytest.approx(MASS * G * REACH * np.cos(angle) / lever(angle), rel=1e-9)
    assert locked["C.rate"][-1] == pytest.approx(0.0, abs=1e-12)
    held = boom(fb.Brake("seal", "C.length", capacity="1 kN")).simulate(0.2)
    assert held["C.length"] == pytest.approx(length_at(0.0), abs=1e-12)


def test_in_space_with_masses():
    """A mast on a ball joint, pushed along a skew line: the same motion as by the force alone, if the rods weigh little."""
    out = {}
    light = {k: fb.Rod(start=(0, 0, 0), end=(1, 0, 0), radius=0.01, mass=1e-6) for k in ("barrel", "rod")}
    for name, rods in (("without", {}), ("with", light)):
        m = fb.Mechanism(name, gravity=(0, 0, -G))
        m.add(fb.Body("mast", mass=5, inertia=(1, 1.2, 0.3), position=(0.5, 0.2, 1)))
        m.add(fb.Universal("A", "ground", "mast", at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0))))
        m.add(fb.LinearActuator("C", "ground", "mast", at=((1, -0.5, 0), (0.5, 0.3, 1)), force="60 - 20*rate", **rods))
        out[name] = m.simulate(0.5, outputs=np.linspace(0, 0.5, 11))
    assert out["with"]["C.length"] == pytest.approx(out["without"]["C.length"], abs=1e-5)
    assert out["with"]["C_slide.displacement"] == pytest.approx(out["with"]["C.length"], abs=1e-10)


@pytest.mark.parametrize("fields", [LAWS["driven"], LAWS["masses"], {"force": "20 kN"}, {}], ids=str)
def test_model_files_have_the_one_element(fields):
    m = boom(**fields)
    text = dumps(m)
    assert text.count("[[joints]]") == 2
    assert "[[drivers]]" not in text
    again = loads(text, fb.Mechanism, "boom.toml")
    assert again == m
    assert dumps(again) == text


def test_what_belongs_to_it_goes_with_it():
    m = boom(**LAWS["masses"])
    m.replace(fb.LinearActuator("C", "ground", "arm", at=ENDS, force=3))
    assert m.names() == ["arm", "A", "C", "C_drive"]
    assert m.changed({"C": None}).names() == ["arm", "A"]
    assert m.changed({"C": fb.LinearActuator("C", "ground", "arm", at=ENDS, length="1.5")})["C_drive"].law == "1.5"
    m.replace(fb.Actuator("C_drive", "C.length", force=1))
    with pytest.raises(ModelError, match="Actuator 'C_drive' differs from what LinearActuator 'C' gives"):
        dumps(m)
    bad = boom()
    with pytest.raises(ModelError, match="LinearActuator 'D': law of Driver 'D_drive': sensor 'v'"):
        bad.add(fb.Sensor("v", "C.rate"), fb.LinearActuator("D", "ground", "arm", at=ENDS, length="1 + v"))
    assert "D" not in bad


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"length": "1", "force": 2}, "leave one out"),
        ({"barrel": RODS["barrel"]}, "it has a barrel and no rod"),
        ({"at": None}, "give its position"),
        ({"at": ((1, 2), (1, 2))}, "it has no direction"),
        ({"length": "1 + x*t"}, "unknown name 'x'"),
        ({"axis": (0, 1)}, "axis has no effect"),
        ({"length": "1 rad"}, "rad"),
    ],
)
def test_refused(fields, why):
    with pytest.raises(ModelError, match=why):
        boom().add(fb.LinearActuator("D", "ground", "arm", **{"at": ENDS} | fields))


def test_no_force_of_its_own():
    r = boom(force=10).simulate(0.01)
    with pytest.raises(AttributeError, match="has no curve 'force'"):
        _ = r["C"].force
    with pytest.raises(ModelError, match="C"):
        boom(fb.Event("e", "C.force > 1", do=[fb.Stop()]))
    with pytest.raises(ModelError, match="nothing that can be released"):
        boom(fb.Event("e", "t > 1", do=[fb.Release("C")]))
    with pytest.raises((ModelError, AnalysisError)):
        boom(**LAWS["driven"]).add(fb.Event("e", "t > 1", do=[fb.Lock("C")]))


def test_an_actuator_without_length_is_named():
    """Driven to the point where its ends coincide, it stops the motion by name; a report of such a motion has no loads."""
    m = fb.Mechanism("slide", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("b", mass=2, inertia=0.1), fb.Prismatic("g", "ground", "b", at=(0, 0), axis=(0, 1)))
    m.add(fb.LinearActuator("d", "ground", "b", at=((0, -1), (0, 0)), speed=-0.5, limit=1000))
    with pytest.raises(fb.SimulationError, match="both ends of LinearActuator 'd' are at one point"):
        m.simulate(3)
    assert "LinearActuator" in m.simulate(0.5).report()
