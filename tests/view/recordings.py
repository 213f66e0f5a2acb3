"""Small made-up recordings for the tests of the views."""

from __future__ import annotations

import numpy as np

from flyball.view.recording import (
    SHOW_OPTIONS,
    Channel,
    RecordedArrow,
    RecordedBody,
    RecordedCurve,
    RecordedFrame,
    RecordedJoint,
    RecordedLine,
    RecordedPath,
    Recording,
    Shape,
)

ALONG_X = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)  # turns a shape's z axis to x
NASTY = "</script><script>window.hacked=1</script> \"q\" 'a' & <b> \U0001f3a1 {{boot}}"


def planar(name: str = "swing") -> Recording:
    """A link swinging on ground, a block sliding beside it, with a spring, a damper and a force."""
    t = np.linspace(0.0, 4.0, 81)
    angle = np.sin(2.0 * t)
    tip = np.stack([np.cos(angle), np.sin(angle), 0 * t], 1)
    slide = np.stack([1.5 + 0.3 * np.cos(t), 0 * t - 1, 0 * t], 1)
    turn = np.stack([np.cos(angle / 2), 0 * t, 0 * t, np.sin(angle / 2)], 1)
    still = np.tile([1.0, 0, 0, 0], (t.size, 1))
    link = RecordedBody("link", (Shape("capsule", (0.08, 1.0), quaternion=ALONG_X),), tip / 2, turn)
    block = RecordedBody("block", (Shape("box", (0.3, 0.2, 0.1)),), slide, still, "teal")
    wall = np.tile([2.5, -1.0, 0.0], (t.size, 1))
    return Recording(
        name,
        True,
        t,
        (link, block),
        (
            RecordedLine("spring", "spring", (slide, wall)),
            RecordedLine("damper", "damper", (tip, slide)),
            RecordedLine("force", "arrow", (tip, tip * [1.0, 1.3, 1.0])),
        ),
        (
            RecordedJoint("pin", "revolute", "ground", (0, 0, 0), (0, 0, 1)),
            RecordedJoint("slot", "prismatic", "ground", (0, -1, 0), (1, 0, 0)),
            RecordedJoint("end", "fixed", "ground", (2.5, -1, 0), (0, 0, 1)),
        ),
        (
            Channel("angle", "rad", angle),
            Channel("rate", "rad/s", np.gradient(angle, t)),
            Channel("height", "m", tip[:, 1]),
        ),
        ("angle", "height"),
        1.0,
        {"Freedoms": "2"},
    )


def spatial(name: str = "tumble") -> Recording:
    """Bodies of every shape tumbling, quaternions with arbitrary signs, and a joint of every kind."""
    rng = np.random.default_rng(7)
    t = np.cumsum(rng.uniform(0.02, 0.06, 60))
    square = ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1))
    shapes = (
        Shape("box", (0.2, 0.1, 0.05)),
        Shape("sphere", (0.1,)),
        Shape("cylinder", (0.1, 0.04)),
        Shape("capsule", (0.03, 0.2)),
        Shape("cone", (0.1, 0.2)),
        Shape("ellipsoid", (0.1, 0.05, 0.08)),
        Shape("plate", (0.02,), outline=square),
    )
    bodies = []
    for k, shape in enumerate(shapes):
        axis = rng.normal(size=3)
        angle = rng.uniform(1, 4) * t
        spin = np.sin(angle / 2)[:, None] * axis / np.linalg.norm(axis)
        q = np.concatenate([np.cos(angle / 2)[:, None], spin], 1) * rng.choice([-1.0, 1.0], (t.size, 1))
        p = np.stack([0.4 * k + 0 * t, np.sin(t + k), np.cos(2 * t)], 1)
        bodies.append(RecordedBody(f"{shape.kind} {k}", (shape,), p, q))
    kinds = ("revolute", "prismatic", "cylindrical", "spherical", "universal", "fixed")
    joints = [RecordedJoint(kind, kind, bodies[k].name, (0, 0, 0), (0, 1, 0)) for k, kind in enumerate(kinds)]
    joints.append(RecordedJoint("base", "revolute", "ground", (0, 0, 0), (1, 0, 0)))
    lines = [
        RecordedLine(kind, kind, (bodies[k].p, bodies[k + 1].p))
        for k, kind in enumerate(("spring", "damper", "link", "rope", "arrow"))
    ]
    channels = tuple(Channel(f"signal {k}", "N", np.sin(k * t)) for k in range(120))
    return Recording(name, False, t, tuple(bodies), tuple(lines), tuple(joints), channels, ("signal 1",), 0.5)


def nasty() -> Recording:
    """A spinning body under names that try to break out of the page."""
    t = np.linspace(0.0, 1.0, 11)
    q = np.stack([np.cos(t), 0 * t, 0 * t, np.sin(t)], 1)
    body = RecordedBody(NASTY, (Shape("sphere", (0.1,)),), np.zeros((t.size, 3)), q, "no such colour")
    channel = Channel(NASTY, "m</script>", np.where(t > 0.5, np.nan, t))
    return Recording(NASTY, False, t, (body,), (), (), (channel,), (NASTY,), 0.1, {NASTY: NASTY})


SYMBOLS = {  # every kind of symbol, with what it needs; the last one nobody knows
    "revolute": (),
    "prismatic": (),
    "cylindrical": (),
    "screw": (0.05,),
    "spherical": (),
    "universal": (),
    "fixed": (),
    "plane": (),
    "rail": (),
    "point": (),
    "wheel": (0.3,),
    "ball": (0.3,),
    "roller": (0.1,),
    "gear": (0.3, 20.0, 0.1, 0.0),
    "rack": (0.3, 0.1),
    "knife_edge": (),
    "bushing": (),
    "orientation": (),
    "yet unknown": (),
}


def tetrahedron(edge: float = 0.3) -> Shape:
    """A mesh of four triangles, all seen from outside."""
    vertices = edge * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    return Shape("mesh", (), vertices=vertices, triangles=triangles)


def loaded(flat: bool = False) -> Recording:
    """Bodies on a circle, one for each kind of symbol; a mesh, a cam, ropes, arrows, axes and a path."""
    t = np.linspace(0.0, 2.0, 41)
    turn = np.stack([np.cos(t / 2), 0 * t, 0 * t, np.sin(t / 2)], 1)
    bodies, joints = [], []
    for k, (kind, size) in enumerate(SYMBOLS.items()):
        angle = 2 * np.pi * k / len(SYMBOLS)
        p = np.tile([3 * np.cos(angle), 3 * np.sin(angle), 0.0], (t.size, 1))
        bodies.append(RecordedBody(f"b{k}", (Shape("box", (0.3, 0.2, 0.1)),) if k % 2 else (tetrahedron(),), p, turn))
        along = (1.0, 0.0, 0.0) if kind in ("prismatic", "rail", "plane", "knife_edge") else (0.0, 0.0, 1.0)
        lying = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0) if along[0] else (1.0, 0.0, 0.0, 0.0)
        reach = (0.0, 0.3, 0.0, 0.2, -0.1, 0.4)
        joints.append(
            RecordedJoint(kind, kind, f"b{k}", (0, 0, 0), along, lying, f"b{k - 1}" if k else None, reach, size)
        )
    joints.append(RecordedJoint("base", "revolute", "ground", tuple(bodies[1].p[0]), (0, 0, 1), mate="b1"))
    a = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    cam = np.stack([(0.2 + 0.1 * np.cos(a)) * np.cos(a), (0.2 + 0.1 * np.cos(a)) * np.sin(a), 0 * a], 1)
    ends = tuple(np.tile(p, (t.size, 1)).astype(float) for p in ((-1, 0, 0), (0, 0.5, 0), (1, 0, 0)))
    distance = 2 * np.sqrt(1.25)
    up = np.array([0.0, 1.0, 0.0]) if flat else np.array([0.0, 0.0, 1.0])
    return Recording(
        "loaded",
        flat,
        t,
        tuple(bodies),
        (
            RecordedLine("taut", "rope", ends, rest=np.full(t.size, 0.9 * distance)),
            RecordedLine("slack", "rope", ends, rest=np.linspace(0.9, 1.2, t.size) * distance),
        ),
        tuple(joints),
        (Channel("b0.x", "m", np.cos(t)), Channel("b0.vx", "m/s", -np.sin(t)), Channel("revolute.angle", "rad", t)),
        ("b0.x",),
        1.0,
        {"Freedoms": "1"},
        (RecordedCurve("profile", "b2", cam, True), RecordedCurve("groove", "ground", cam[:20])),
        (
            RecordedArrow("push", "load", "force", "b1", (0.1, 0, 0), 50 * (np.outer(np.cos(t), (1, 0, 0)) + up)),
            RecordedArrow("base", "reaction", "force", "b1", (0, 0, 0), -50 * np.outer(np.ones(t.size), up)),
            RecordedArrow("base", "reaction", "moment", "b1", (0, 0, 0), np.outer(8 * np.sin(t), (0, 0, 1))),
            RecordedArrow("motor", "element", "moment", "b3", (0, 0, 0), np.outer(-5 - t, (0, 0, 1))),
        ),
        (RecordedFrame("base", "joint", "b1", (0.2, 0, 0), (1, 0, 0, 0)),),
        (RecordedPath("tip", "b1", (0.5, 0.0, 0.0)),),
        tuple(SHOW_OPTIONS),
        {"b0": ("Body", "1 kg"), "base": ("Revolute", "ground – b1")},
        (),
        tuple(-up),
    )
