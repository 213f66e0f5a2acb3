"""Contact described wrongly: the message names element, value, rule and remedy."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.tables.contact_tables import contact_tables
from flyball.tables.element_numbers import element_numbers

BALL = fb.Sphere(radius=0.1)


def scene(planar: bool = False) -> fb.Mechanism:
    m = fb.Mechanism("scene", planar=planar, gravity=(0, -9.81) if planar else (0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1) if planar else None)))
    m.add(fb.Body("ball", shape=BALL, density=1000), fb.Body("other", shape=BALL, density=1000))
    m.add(fb.Body("bare", mass=1, inertia=1 if planar else (1, 1, 1)))
    m.add(fb.Material("rubber", friction=0.8), fb.Material("wood", friction=(0.2, 0.4), grain=(1, 0, 0)))
    return m


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"friction": -0.1}, r"friction is -0.1; it must be zero or greater"),
        ({"friction": (0.1, -0.2), "grain": (1, 0, 0)}, r"friction is -0.2; it must be zero or greater"),
        ({"friction": (0.1, 0.2, 0.3), "grain": (1, 0, 0)}, r"friction must be one number, or two"),
        ({"friction": (0, 0.2), "grain": (1, 0, 0)}, r"friction along the grain is 0(?s:.*)swap"),
        ({"friction": (0.1, 0.2)}, r"give the direction of the first: grain="),
        ({"friction": (0.1, 0.2), "grain": (0, 0, 0)}, r"grain has no length"),
        ({"friction": 0.1, "grain": (1, 0, 0)}, r"grain has no effect"),
        ({"restitution": 1.1}, r"restitution is 1.1; it must be from 0 to 1"),
        ({"restitution": -0.1}, r"restitution is -0.1; it must be zero or greater"),
        ({"friction": 0.5, "static_friction": 0.4}, r"static_friction is 0.4, below friction"),
        ({"static_friction": 0.4}, r"static_friction needs friction"),
        ({"rolling_friction": "-1 mm"}, r"rolling_friction is -0.001 m; it must be zero or greater"),
        ({"spinning_friction": "1 kg"}, r"spinning_friction(?s:.*)kg"),
        ({"friction": "1 mm"}, r"friction of Material 'x'(?s:.*)mm"),
        ({"surface_velocity": (1, 2, 3, 4)}, r"surface_velocity of Material 'x': expected 3 components"),
        ({"youngs_modulus": "210 GPa"}, r"youngs_modulus needs poissons_ratio"),
        ({"youngs_modulus": -1, "poissons_ratio": 0.3}, r"youngs_modulus is -1 Pa; it must be greater than 0"),
        ({"youngs_modulus": 1e9, "poissons_ratio": 0.7}, r"poissons_ratio is 0.7; it must be above -1 and at most 0.5"),
        ({"bounce": 1}, r"unknown field 'bounce'"),
    ],
)
def test_materials(fields, message):
    with pytest.raises(fb.ModelError, match=rf"Material 'x'(?s:.*){message}|{message}"):
        scene().add(fb.Material("x", **fields))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fb.Contact(friction=-1), r"Contact 'contact': friction is -1"),
        (lambda: fb.Contact(friction=0.3, between="bal"), r"no body named 'bal' \(did you mean 'ball'\?\)"),
        (lambda: fb.Contact(friction=0.3, between="rubber"), r"'rubber' is a Material"),
        (lambda: fb.Contact(friction=0.3, between="bare"), r"Body 'bare' has no shape that touches"),
        (lambda: fb.Contact(friction=0.3, others="ball"), r"give between="),
        (lambda: fb.Contact(friction=0.3, between=["ball", "ball"]), r"give each name once"),
        (lambda: fb.Contact(friction=0.3, exclude=[("ball", "ball")]), r"does not touch itself"),
        (lambda: fb.Contact(friction=0.3, exclude=["ball"]), r"give pairs of names"),
        (lambda: fb.Contact(friction=0.3, exclude=[("ball", "nobody")]), r"no body named 'nobody'"),
        (lambda: fb.Body("x", shape=BALL, density=1, material="rubbr"), r"Body 'x'(?s:.*)did you mean 'rubber'"),
        (lambda: fb.Body("x", shape=fb.Sphere(radius=1, material="ball"), density=1), r"'ball' is a Body"),
        (lambda: fb.Body("x", shape=fb.Sphere(radius=1, hole=True, contact=True), density=1), r"a hole touches nothing"),
        (lambda: fb.Body("x", shape=fb.Plane(), density=1), r"Plane: it has no volume and so no mass"),
        (lambda: fb.Body("x", shape=fb.Sphere(radius=0), density=1), r"radius is 0 m; it must be greater than 0"),
        (lambda: fb.Body("x", mass=1, inertia=(1, 1, 1), material="rubber"), r"material 'rubber' has no effect, since it has"),
        (lambda: fb.Body("x", shape=fb.Sphere(radius=1, material="wood"), density=1, material="rubber"),
         r"material 'rubber' has no effect, since its shapes"),
        (lambda: fb.Ground("x", shape=fb.Sphere(radius=1, looks=True, material="wood")), r"material of Sphere has no effect"),
        (lambda: fb.MaterialPair("rubber", "wod", friction=0.1), r"no material named 'wod'"),
        (lambda: fb.MaterialPair("rubber", "wood"), r"it has no effect"),
        (lambda: fb.Ground("wall"), r"field 'shape' is missing"),
        (lambda: fb.Ground("wall", shape=[]), r"it has no shape"),
        (lambda: fb.Ground("wall", shape=fb.Box(edges=(1, 1, 1), density=7)), r"has a density, which means nothing"),
        (lambda: fb.Ground("wall", shape=fb.Plane(normal=(0, 0, 0))), r"has no length"),
        (lambda: fb.Limit("stop", "floor.angle", lower=0), r"there is no joint named 'floor'"),
        (lambda: fb.Limit("stop", "ball.x"), r"it stops nothing"),
        (lambda: fb.Limit("stop", "ball.x", lower=1, upper=0), r"lower is 1 m; it must not be greater than upper, 0 m"),
        (lambda: fb.Limit("stop", "ball.x", lower="1 deg"), r"lower of Limit 'stop'(?s:.*)deg"),
        (lambda: fb.Limit("stop", "ball.x", lower=1, restitution=2), r"restitution is 2; it must be from 0 to 1"),
    ],
)  # fmt: skip
def test_parts(make, message):
    with pytest.raises(fb.ModelError, match=message):
        scene().add(make())


def test_two_contacts_for_everything():
    m = scene()
    m.add(fb.Contact(friction=0.3))
    with pytest.raises(fb.ModelError, match=r"Contact 'more': Contact 'contact' already applies to all bodies"):
        m.add(fb.Contact("more", friction=0.3))
    m.add(fb.MaterialPair("rubber", "wood", friction=0.1))
    with pytest.raises(fb.ModelError, match=r"is about the same two materials"):
        m.add(fb.MaterialPair("wood", "rubber", friction=0.1))


def test_two_contacts_that_name_the_same_pair():
    m = scene()
    m.add(fb.Contact("a", between=["ball", "floor"], friction=0.3))
    m.add(fb.Contact("b", between="ball", others="other", friction=0.3))
    with pytest.raises(fb.ModelError, match=r"Contact 'c': Contact 'a' already applies to 'ball' and 'floor'"):
        m.add(fb.Contact("c", between="ground", others=["ball", "other"], friction=0.3))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"position": [(0, 0, 0), (1, 0, np.nan)]}, r"position\[1, 2\] is nan"),
        ({"position": [0, 0, 0]}, r"position has the shape \(3,\)"),
        ({"position": np.zeros((2, 2))}, r"position has the shape \(2, 2\); it must be \(2, 3\)"),
        ({"position": np.zeros((0, 3))}, r"a row for each body"),
        ({"position": [(0, 0, 0), (0, 0)]}, r"as long in every row"),
        ({"position": "nowhere.npy"}, r"cannot read '.*nowhere.npy': No such file"),
        ({"position": "nowhere.txt"}, r"'\*.npy' or '\*.csv'"),
        ({"position": [("1 mm", 0, 0)]}, r"give an array of numbers"),
        ({"velocity": np.zeros((3, 3))}, r"velocity has the shape \(3, 3\); it must be \(2, 3\)"),
        ({"orientation": np.zeros((2, 4))}, r"orientation of Bodies 'balls'"),
        ({"orientation": np.ones((2, 3))}, r"orientation has the shape \(2, 3\); it must be \(2, 4\)"),
        ({"angle": [1, 2]}, r"in a spatial mechanism give orientation="),
        ({"scale": [1, 0]}, r"scale\[1\] is 0; it must be greater than 0"),
        ({"scale": [1, 2, 3]}, r"scale has the shape \(3,\); it must be \(2,\)"),
        ({"density": None}, r"its mass is missing"),
        ({"density": -1}, r"density is -1"),
        ({"shape": fb.Sphere(radius=-1)}, r"radius is -1 m"),
        ({"shape": fb.Plane()}, r"has no volume"),
    ],
)
def test_many_bodies(fields, message):
    given = {"shape": BALL, "position": [(0, 0, 0), (1, 0, 0)], "density": 1000} | fields
    with pytest.raises(fb.ModelError, match=rf"Bodies 'balls'(?s:.*){message}|{message}"):
        scene().add(fb.Bodies("balls", **given))


def test_joints_and_forces_do_not_take_many_bodies():
    m = scene()
    m.add(fb.Bodies("balls", shape=BALL, position=[(0, 0, 0)], density=1000))
    with pytest.raises(fb.ModelError, match=r"'balls' is a Bodies, no body or frame"):
        m.add(fb.Revolute("J", "ground", "balls", at=(0, 0, 0), axis=(0, 0, 1)))


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (fb.Plane(), r"its normal must lie in the plane of the mechanism, for instance normal=\(0, 1\)"),
        (fb.Cylinder(radius=1, length=1, orientation=(0.5, 0, 0)), r"it is oblique to the plane"),
        (fb.Ellipsoid(semi_axes=(1, 2, 3)), r"Ellipsoid has no outline for contact detection; give it contact=False"),
    ],
)
def test_shapes_without_an_outline(shape, message):
    m = scene(planar=True)
    m.add(fb.Ground("wall", shape=shape), fb.Contact(friction=0.1))
    with pytest.raises(fb.ModelError, match=rf"Ground 'wall': {type(shape).__name__}: {message}"):
        contact_tables(m, element_numbers(m), ["ball"])


def test_contact_on_a_body_without_mass():
    m = scene()
    m.add(fb.Body("ring", mass=0, inertia=(0, 0, 0), shape=BALL), fb.Contact(friction=0.1))
    with pytest.raises(fb.ModelError, match=r"Body 'ring': it touches and has no mass"):
        contact_tables(m, element_numbers(m), ["ball", "ring"])


def test_analyses_that_know_no_contact_say_so():
    m = scene()
    m.add(fb.Limit("stop", "ball.x", lower=0), fb.Contact(friction=0.1))
    for ask in (
        m.prepare,
        lambda: m.kinematics(3),
        lambda: m.compare(1.0),
        lambda: m.inverse_dynamics(3),
        lambda: m.equilibria("x", [1, 2]),
        lambda: m.root_locus("x", [1, 2]),
        lambda: m.singularities("x", range=(0, 1)),
        lambda: m.sensitivity(["ball.x"], ["x"]),
        lambda: m.optimize(["ball.x"], {"x": (0, 1)}, target=[0]),
    ):
        with pytest.raises(
            fb.ModelError, match=r"'scene' has Contact 'contact'(, Limit 'stop')?, and \w+ supports no contact"
        ):
            ask()


@pytest.mark.parametrize("law", ["newton", "moreau"])
def test_a_law_that_impacts_one_after_the_other_do_not_know(law):
    with pytest.raises(fb.ModelError, match=f"restitution='{law}' has no effect"):
        fb.Stepping(impacts="sequential", restitution=law)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"law": "herz"}, r"give one of hard, linear, hertz, hunt-crossley"),
        ({"stiffness": 1e5}, r"stiffness has no effect with law='hard'"),
        ({"law": "hertz", "stiffness": 1e5, "dissipation": 1}, r"dissipation has no effect with law='hertz'"),
        ({"law": "hunt-crossley", "stiffness": 1e5, "damping": 1}, r"damping has no effect(?s:.*)a number of linear"),
        ({"law": "linear"}, r"needs stiffness"),
        ({"law": "linear", "stiffness": 0}, r"stiffness is 0; it must be greater than 0"),
        ({"law": "hertz", "stiffness": "1 N/m"}, r"stiffness: '1 N/m': expected(?s:.*)N/m\^1.5"),
        ({"law": "hunt-crossley", "stiffness": "1 N/m", "exponent": 2}, r"expected(?s:.*)N/m\^2"),
        ({"law": "hunt-crossley", "stiffness": 1, "exponent": 0.5}, r"exponent is 0.5; it must be from 1"),
        ({"law": "hunt-crossley", "stiffness": 1, "dissipation": -1}, r"dissipation is -1 s/m; it must be zero or gr"),
        ({"law": "hertz", "stiffness": 1, "restitution": 0.5}, r"restitution is of hard contact"),
    ],
)
def test_laws_of_the_normal_force(fields, message):
    with pytest.raises(fb.ModelError, match=message):
        scene().add(fb.Contact(friction=0.3, **fields))


def test_stiffness_that_nothing_says():
    m = scene()
    m.add(fb.Contact(friction=0.3, law="hertz"))
    with pytest.raises(
        fb.ModelError, match=r"does not define the stiffness of(?s:.*)youngs_modulus(?s:.*)give stiffness="
    ):
        contact_tables(m, element_numbers(m), ["ball", "other"])


def test_elastic_constants_say_nothing_of_a_box_on_a_floor():
    m = scene()
    m.add(fb.Material("steel", youngs_modulus="210 GPa", poissons_ratio=0.3))
    box = fb.Box(edges=(1, 1, 1))
    m.add(fb.Body("box", shape=box, density=1, material="steel"))
    m.replace(fb.Ground("floor", shape=fb.Plane(), material="steel"))
    m.add(fb.Contact(between="box", others="floor", friction=0.3, law="hertz"))
    with pytest.raises(fb.ModelError, match=r"only for spheres on spheres or on flat shapes(?s:.*)stiffness="):
        contact_tables(m, element_numbers(m), ["ball", "other", "box"])
