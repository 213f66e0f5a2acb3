"""flyball on the scenes of contact: the mechanisms as a user writes them, and their steps one by one."""

from __future__ import annotations

import time
from typing import Any

import contact_scenes as cs
import numpy as np

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.simulation.impulse_stepping.setup import choose_step, make_stepper, movers_of_assembly, partition_bodies
from flyball.tables.contact_tables import contact_tables


def shape(kind: str) -> Any:
    """The shape of a body in a pile."""
    return {
        "sphere": fb.Sphere(radius=cs.RADIUS),
        "box": fb.Box(edges=tuple(2.0 * x for x in cs.BOX)),
        "capsule": fb.Capsule(radius=cs.CAPSULE[0], length=2.0 * cs.CAPSULE[1]),
        "cylinder": fb.Cylinder(radius=cs.CYLINDER[0], length=2.0 * cs.CYLINDER[1]),
    }[kind]


def floor(friction: float, walls: float | None = None) -> Any:
    """A mechanism with a floor, and walls around it."""
    m = fb.Mechanism("scene", gravity=(0, 0, -cs.G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    for k, (x, y) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1)) if walls else ()):
        n = np.array([x, y, 0.0])
        R = np.stack([np.cross(n, [0, 0, 1.0]), [0, 0, 1.0], n], axis=1)
        R[:, 1] = np.cross(R[:, 2], R[:, 0])
        m.add(fb.Ground(f"wall{k}", shape=fb.Plane(), position=tuple(-walls * n), orientation=R))
    m.add(fb.Contact(friction=friction))
    return m


def pile(p: cs.Pile) -> Any:
    """A pile in its box."""
    m = floor(cs.PILE_FRICTION, p.half)
    for kind in dict.fromkeys(p.kind.tolist()):
        k = p.kind == kind
        m.add(
            fb.Bodies(
                f"{kind}s", shape=shape(kind), density=cs.DENSITY, position=p.position[k], orientation=p.quaternion[k]
            )
        )
    return m


def stack(s: cs.Stack) -> Any:
    """A stack on the floor."""
    m = floor(cs.STACK_FRICTION)
    for k, (mass, x, a) in enumerate(zip(s.mass, s.position, s.yaw, strict=True)):
        m.add(
            fb.Body(
                f"cube{k}",
                mass=float(mass),
                inertia=(float(mass) / 6.0,) * 3,
                shape=fb.Box(edges=(1, 1, 1)),
                position=tuple(x.tolist()),
                orientation=(np.cos(a / 2), 0, 0, np.sin(a / 2)),
            )
        )
    return m


class Run:
    """flyball at work on a scene, step by step as `simulate` takes them."""

    def __init__(self, model: Any, options: Any) -> None:
        model = model.snapshot()
        base = assemble(model, t=0.0)
        values = base.compiled.values
        found = partition_bodies(model, values)
        scene = contact_tables(model, values.given, (*found.free, *found.held))
        self.scene = scene
        movers = movers_of_assembly(scene, base)
        self.stepper = make_stepper(scene, movers, values, options, choose_step(options, scene, movers, values))

    def step(self) -> float:
        """One step; its CPU seconds."""
        began = time.process_time()
        self.stepper.run(1, cs.H)
        return time.process_time() - began

    def figures(self) -> dict[str, float]:
        """Contacts, deepest overlap now and ever [mm], kinetic energy [J]."""
        s = self.stepper
        C, _ = s.last()
        v, m = s.workspaces.X.v, self.scene.carriers.mass
        R = s.movers.pose[:, 3:].reshape(-1, 3, 3)
        w = np.einsum("bij,bi->bj", R, v[:, 3:6])
        kinetic = 0.5 * m @ (v[:, :3] ** 2).sum(axis=1) + 0.5 * np.einsum(
            "bi,bij,bj->", w, self.scene.carriers.inertia, w
        )
        return {
            "contacts": int(C.count.found),
            "overlap": float(-1e3 * np.min(C.x.gap[: C.count.found], initial=0.0)),
            "worst": float(-1e3 * min(0.0, s.state.worst.overlap)),
            "kinetic": float(kinetic),
        }

    def centres(self) -> np.ndarray:
        """Centres of the bodies [m]."""
        return self.stepper.movers.pose[:, :3].copy()
