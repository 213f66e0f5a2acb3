"""Lines of use and signs of the reference (site-src/uses.py): every line makes what it says, every sign is so."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

import flyball as fb
from flyball.model.element import Element
from flyball.model.roads.road import RoadSurface
from flyball.model.shapes import Solid
from flyball.rotations import from_axis_angle, matrix
from tests.pages import ROOT

_spec = importlib.util.spec_from_file_location("uses", ROOT / "site-src" / "uses.py")
uses = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(uses)
DESCRIBING = [k for k in dir(fb) if isinstance(c := getattr(fb, k), type) and issubclass(c, Element)]
PARAMETERS = dict.fromkeys(("speed", "k", "power", "command"), 1.0)
PLACES = {True: {"at": (0, 0)}, False: {"at": (0, 0, 0), "axis": (0, 0, 1)}}


def around(e: Element, planar: bool) -> fb.Mechanism:
    """A mechanism with what the lines name: bodies, hinges A, B, D, slides."""
    m = fb.Mechanism("around", planar=planar, parameters=PARAMETERS)
    named = {getattr(e, k, None) for k in ("body_i", "body_j", "body", "frame")} | set(getattr(e, "bodies", None) or ())
    for name in sorted(
        {"a", "b", "d", "s", "p", "r", "tip", *(n for n in named if isinstance(n, str))} - {"ground", e.name}
    ):
        m.add(fb.Body(name, mass=1, inertia=0.01 if planar else (0.01, 0.01, 0.01)))
    slide = {"at": PLACES[planar]["at"], "axis": (1, 0) if planar else (1, 0, 0)}
    parts = [fb.Revolute(n, "ground", b, **PLACES[planar]) for n, b in (("A", "a"), ("B", "b"), ("D", "d"))]
    parts += [
        fb.Revolute("pinion_hinge", "ground", "p", **PLACES[planar]),
        fb.Prismatic("rack_slide", "ground", "r", **slide),
    ]
    parts += [fb.Prismatic("slide", "ground", "s", **slide), fb.Fixed("latch", "a", "b", at=slide["at"])]
    parts += [fb.Material(n, friction=0.5) for n in ("rubber", "steel")]
    m.add(*(p for p in parts if p.name != e.name))
    return m


def test_every_description_has_a_line():
    assert set(DESCRIBING) <= set(uses.USES)
    assert set(uses.SIGNS) <= set(uses.USES)


@pytest.mark.parametrize("name", sorted(set(uses.USES) - {"Stepping", "Mesh", "FMU"}))
def test_a_line_makes_what_it_says(name):
    e = eval(uses.USES[name], {"fb": fb})
    assert type(e).__name__ == name
    if isinstance(e, Solid):
        wrapped = fb.Ground if name in ("Plane", "HeightField") else fb.Body
        m = fb.Mechanism("shape")
        m.add(wrapped("b", shape=e, **({"density": 1000} if wrapped is fb.Body else {})))
    elif e.category == "tyre models" if isinstance(e, Element) else False:
        assert e.kind >= 0
    elif isinstance(e, RoadSurface):
        assert fb.Road("road", surface=e).surface == e
    elif name not in ("Impulse", "Lock", "Note", "Release", "Set", "Stop"):
        refused = []
        for planar in (True, False):
            try:
                around(e, planar).add(e)
            except fb.ModelError as error:
                refused.append(str(error))
        assert len(refused) < 2, refused


def posed(joint, **coordinates) -> fb.Result:
    """The joint between ground and a free body, at these coordinates."""
    m = fb.Mechanism("signs")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)), joint)
    m.add(*(fb.Initial(f"{joint.name}.{k}", value=v) for k, v in coordinates.items()))
    return m.simulate(1e-3, outputs=2)


def turned(axis, angle):
    return matrix(from_axis_angle(np.array(axis, float), angle))


def test_signs_of_joints():
    z = {"at": (0, 0, 0), "axis": (0, 0, 1)}
    r = posed(fb.Revolute("A", "ground", "b", **z), angle=0.3)
    np.testing.assert_allclose(r["b"].rotation[0], turned((0, 0, 1), 0.3), atol=1e-9)
    r = posed(fb.Prismatic("A", "ground", "b", **z), displacement=0.3)
    np.testing.assert_allclose(r["b"].position[0], (0, 0, 0.3), atol=1e-9)
    r = posed(fb.Screw("A", "ground", "b", lead=0.1, **z), angle=np.pi / 2)
    np.testing.assert_allclose(r["b"].position[0], (0, 0, 0.025), atol=1e-9)
    np.testing.assert_allclose(r["b"].rotation[0], turned((0, 0, 1), np.pi / 2), atol=1e-9)
    joint = fb.Universal("A", "ground", "b", at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0)))
    r = posed(joint, angle_1=0.3, angle_2=0.4)
    np.testing.assert_allclose(r["b"].rotation[0], turned((1, 0, 0), 0.3) @ turned((0, 1, 0), 0.4), atol=1e-9)


def test_signs_of_forces():
    m = fb.Mechanism("signs", planar=True)
    m.add(fb.Body("b", mass=2, inertia=1, position=(1, 0), velocity=(0.5, 0)))
    m.add(fb.SpringDamper("spring", "ground", "b", at=((0, 0), (1, 0)), stiffness=10, damping=4, length=0.7))
    assert m.simulate(1e-3)["b.ax"][0] == pytest.approx(-(10 * 0.3 + 4 * 0.5) / 2, rel=1e-9)
    m = fb.Mechanism("signs", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Revolute("A", "ground", "b", at=(0, 0)), fb.Motor("motor", "A", torque=3))
    assert m.simulate(1e-3)["A.angle_acceleration"][0] == pytest.approx(3, rel=1e-9)
    m = m.changed({"motor": None})
    m.add(fb.Actuator("push", "A.angle", force=3))
    assert m.simulate(1e-3)["A.angle_acceleration"][0] == pytest.approx(3, rel=1e-9)
