"""What analyses say of a mechanism that touches, where they count no contact."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

SHAPE = fb.Box(edges=(0.1, 0.2, 0.3), position=(0.1, 0, 0))


def scenes() -> tuple[fb.Mechanism, fb.Mechanism]:
    """Bricks as many, and one by one; a ball besides."""
    rng = np.random.default_rng(4)
    p, e, s = rng.normal(size=(5, 3)), rng.normal(size=(5, 4)), rng.uniform(1, 2, 5)
    many, single = (fb.Mechanism("pile", gravity=(0, 0, -9.81)) for _ in range(2))
    many.add(fb.Bodies("bricks", shape=SHAPE, density=800, position=p, orientation=e, scale=s))
    for k in range(5):
        shape = fb.Box(edges=s[k] * np.array(SHAPE.edges), position=(0.1 * s[k], 0, 0))
        single.add(fb.Body(f"b{k}", shape=shape, density=800, position=p[k], orientation=tuple(e[k])))
    for m in (many, single):
        m.add(fb.Body("ball", shape=fb.Sphere(radius=0.2), density=800))
        m.add(fb.Contact(friction=0.3))
    return many, single


def test_many_bodies_weigh_what_single_ones_do() -> None:
    many, single = (m.mass_properties() for m in scenes())
    assert many.total.mass == pytest.approx(single.total.mass)
    assert many.total.com == pytest.approx(single.total.com)
    assert many.total.inertia == pytest.approx(single.total.inertia)
    assert set(many.bodies) == {"ball", "bricks"}


def test_freedoms_are_those_without_contact_and_it_is_said() -> None:
    many, _ = scenes()
    many.add(fb.Limit("stop", "ball.z", lower=-1))
    for text in (str(many.mobility()), "\n".join(many.check().warnings)):
        assert "Contact 'contact', Limit 'stop': freedoms and the start are those without" in text
        assert "the 5 bodies of Bodies 'bricks'" in text
    assert many.mobility().freedoms == 6
    assert not any("neither a joint nor a force" in x for x in many.check().warnings)


def test_a_mechanism_without_its_contact_is_asked_as_told() -> None:
    many, _ = scenes()
    with pytest.raises(fb.ModelError) as error:
        many.kinematics(3)
    assert "m.changed({'contact': None, 'bricks': None}).kinematics(...)" in str(error.value)
    assert many.changed({"contact": None, "bricks": None}).check().warnings


def test_a_floor_that_nothing_touches_is_told():
    """Who forgets the contact is told so, not left with a body below the floor."""
    m = fb.Mechanism("fall", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    m.add(fb.Body("box", mass=1, shape=fb.Box(edges=(0.1, 0.1, 0.1)), position=(0, 0, 1)))
    assert any("'floor' touches nothing" in w for w in m.simulate(0.1).health.warnings)
    m.add(fb.Contact(friction=0.3))
    assert not any("touches nothing" in w for w in m.simulate(0.1).health.warnings)


def test_a_body_without_a_shape_beside_contact_is_named():
    """It falls through the floor, since it has nothing to touch it with. What something carries is no such body."""

    def warned(*parts, contact=None):
        m = fb.Mechanism("fall", gravity=(0, 0, -9.81))
        m.add(fb.Ground("floor", shape=fb.Plane()))
        m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), density=1000, position=(1, 0, 0.1)))
        m.add(fb.Body("b", mass=1, inertia=(1, 1, 1), position=(0, 0, 1)), *parts, contact or fb.Contact(friction=0.3))
        return [w for w in m.simulate(0.01, outputs=2).health.warnings if "no shape" in w]

    (said,) = warned()
    assert "body 'b' has no shape" in said and "Contact 'contact'" in said
    other = fb.Body("c", mass=1, inertia=(1, 1, 1), position=(0, 0, 2))
    (said,) = warned(other, fb.Fixed("weld", "b", "c", at=(0, 0, 1)))
    assert "bodies 'b', 'c' have no shape" in said
    assert not warned(fb.Revolute("A", "ground", "b", at=(0, 0, 2), axis=(0, 1, 0)))
    assert not warned(other, fb.Fixed("weld", "b", "c", at=(0, 0, 1)), fb.Spherical("S", "c", "ball", at=(1, 0, 0.1)))
    spring = fb.SpringDamper("k", "ground", "b", at=((0, 0, 2), (0, 0, 1)), stiffness=100, length=1)
    assert not warned(spring)
    assert not warned(fb.CoordinateSpring("k", "b.z", stiffness=100, rest=1))
    assert not warned(fb.Driver("D", "b.z", law="1"))
    assert not warned(contact=fb.Contact(between=["ball"], others=["ground"], friction=0.3))
