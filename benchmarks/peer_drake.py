"""A tree without loops in Drake: a continuous plant and its integrators with error control.

Continuous plants take no constraints that close loops, and discrete ones are of first order; so only trees are here.
"""

from __future__ import annotations

import time

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PrismaticJoint,
    RevoluteJoint,
    RevoluteSpring,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from trees import Motion, Tree

from mechanisms import GROUND

SETTINGS = {"RK3, error control": "runge_kutta3"}  # that of order 5 has not ended on the humanoid after a minute
FREE = 6  # joints of a link that are one free joint


class Built:
    """The plant; every link's frame is drawn at its mass centre, along the world's axes."""

    def __init__(self, tree: Tree) -> None:
        if tree.cuts or tree.springs or tree.motors:
            raise ValueError("only trees with springs at their hinges are built for this engine")
        self.tree, self.plant = tree, MultibodyPlant(0.0)
        self.plant.mutable_gravity_field().set_gravity_vector(tree.gravity)
        self.bodies, self.joints = [], []
        for link in tree.links:
            J = np.asarray(link.inertia)
            inertia = RotationalInertia(*np.diag(J), J[0, 1], J[0, 2], J[1, 2])
            made = SpatialInertia.MakeFromCentralInertia(link.mass, np.zeros(3), inertia)
            self.bodies.append(self.plant.AddRigidBody(link.name, made))
            if len(link.axes) == 1:
                self.joint(link)
            elif len(link.axes) != FREE:
                raise ValueError("a link has one joint, or is free")
        self.plant.Finalize()

    def joint(self, link) -> None:
        """The one joint of a link, the last that was added, with its spring."""
        a = link.axes[0]
        ground = link.parent == GROUND
        above = self.plant.world_frame() if ground else self.bodies[link.parent].body_frame()
        before = np.zeros(3) if ground else self.tree.links[link.parent].centre
        sides = ("on", above, before), ("of", self.bodies[-1].body_frame(), link.centre)
        ends = [
            self.plant.AddFrame(FixedOffsetFrame(f"{which} {link.name}", frame, RigidTransform(a.point - x)))
            for which, frame, x in sides
        ]
        kind = RevoluteJoint if a.kind == "hinge" else PrismaticJoint
        joint = self.plant.AddJoint(kind(f"joint of {link.name}", *ends, a.direction, damping=a.damping))
        self.joints.append(joint)
        if a.stiffness:
            self.plant.AddForceElement(RevoluteSpring(joint, a.rest, a.stiffness))

    def start(self, context) -> None:
        """Put the start into a context."""
        n, joints = 0, iter(self.joints)
        for body, link in zip(self.bodies, self.tree.links, strict=True):
            rates = self.tree.rates[n : n + len(link.axes)]
            n += len(link.axes)
            if len(link.axes) == FREE:
                self.plant.SetFreeBodyPose(context, body, RigidTransform(link.centre))
                self.plant.SetFreeBodySpatialVelocity(context, body, SpatialVelocity(rates[:2:-1], rates[:3]))
                continue
            joint = next(joints)
            (joint.set_angular_rate if link.axes[0].kind == "hinge" else joint.set_translation_rate)(context, rates[0])

    def motion(self, states: list[np.ndarray]) -> Motion:
        """Of the links, at states."""
        context = self.plant.CreateDefaultContext()
        out = [[], [], [], []]
        for x in states:
            self.plant.SetPositionsAndVelocities(context, x)
            poses = [self.plant.EvalBodyPoseInWorld(context, b) for b in self.bodies]
            twists = [self.plant.EvalBodySpatialVelocityInWorld(context, b) for b in self.bodies]
            out[0].append([p.translation() for p in poses])
            out[1].append([p.rotation().matrix() for p in poses])
            out[2].append([v.translational() for v in twists])
            out[3].append([v.rotational() for v in twists])
        return Motion(*(np.array(part) for part in out))


def solve(tree: Tree, t_end: float, accuracy: float, setting: str, samples: int = 0):
    """Integrate. Returns (motion, CPU seconds of the stepping); no motion where samples is 0."""
    built = Built(tree)
    plant = built.plant
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    built.start(context)
    integrator = ResetIntegratorFromFlags(simulator, SETTINGS[setting], t_end)
    integrator.set_target_accuracy(accuracy)
    simulator.Initialize()
    states = [plant.GetPositionsAndVelocities(context).copy()]
    begin = time.process_time()
    for t in np.linspace(0.0, t_end, max(samples, 1) + 1)[1:]:
        simulator.AdvanceTo(t)
        states.append(plant.GetPositionsAndVelocities(context).copy())
    seconds = time.process_time() - begin
    return (built.motion(states) if samples else None), seconds


def start_accelerations(tree: Tree) -> np.ndarray:
    """Acceleration of each centre and angular acceleration, (links, 6), at the start."""
    built = Built(tree)
    context = built.plant.CreateDefaultContext()
    built.start(context)
    out = []
    for body in built.bodies:
        a = body.EvalSpatialAccelerationInWorld(context)
        out.append(np.r_[a.translational(), a.rotational()])
    return np.array(out)
