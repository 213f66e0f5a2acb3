"""What happens does not depend on how long a motion is: supports hold, impacts are told, in spans of a nanosecond too."""

import pytest

import flyball as fb
from tests.layers import both_layers

G = 9.81
SPANS = (1e-3, 1e-7, 1e-9, 1e-12)


def ball(planar, v=0.0):
    up = (0, 1) if planar else (0, 0, 1)
    m = fb.Mechanism("ball", planar=planar, gravity=tuple(-G * x for x in up))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=up)), fb.Contact(friction=0.3, restitution=0.0))
    m.add(
        fb.Body(
            "b", mass=2, inertia=0.01 if planar else [0.01] * 3, position=tuple(0.05 * x for x in up),
            velocity=tuple(-v * x for x in up), shape=fb.Sphere(radius=0.05, looks=True, contact=True),
        )
    )  # fmt: skip
    return m


@pytest.mark.parametrize("span", SPANS)
@pytest.mark.parametrize("method", ["dop853", "radau", "impulse"])
@pytest.mark.parametrize("planar", [True, False])
def test_a_floor_holds(planar, method, span):
    r = ball(planar).simulate(span, outputs=3, method=method)
    part = 1e-2 if method == "impulse" else 1e-9
    assert r["b"].contact_force[-1, -1] == pytest.approx(2 * G, rel=part)
    assert abs(r["b"].velocity[-1, -1]) < part * G * span


def held(kind):
    m = fb.Mechanism("held", planar=True, gravity=(0, -G))
    m.add(fb.Body("b", mass=2, inertia=0.01, position=(0, -1)))
    if kind != "rope":
        m.add(fb.Prismatic("P", "ground", "b", at=(0, -1), axis=(0, 1)))
    m.add(
        {
            "limit": lambda: fb.Limit("L", "P.displacement", lower=0, upper=1),
            "friction": lambda: fb.JointFriction("L", "P", static=0.2, preload=200.0),
            "one way": lambda: fb.OneWay("L", "P.displacement"),
            "rope": lambda: fb.Rope("L", ("ground", "b"), at=((0, 0), (0, -1))),
        }[kind]()
    )
    return m


@both_layers
@pytest.mark.parametrize("span", SPANS)
@pytest.mark.parametrize("kind", ["limit", "friction", "one way", "rope"])
def test_what_holds_a_weight_holds(kind, span):
    r = held(kind).simulate(span, outputs=3)
    assert abs(r["b"].velocity[-1, -1]) < 1e-9 * G * span
    assert abs(r["b"].acceleration[-1, -1]) < 1e-9 * G


@pytest.mark.parametrize("span", SPANS)
def test_what_an_impact_takes_is_told(span):
    """2 kg at 0.3 m/s."""
    (hit, *_) = ball(True, v=0.3).simulate(span, outputs=2).events
    assert hit.kind == "impact"
    assert hit.lost == pytest.approx(0.09)
