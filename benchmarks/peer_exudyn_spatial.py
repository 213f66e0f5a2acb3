"""A spatial mechanism in Exudyn: rigid bodies with Euler parameters, joints as constraints, an implicit solver.

All joints are constraints, those of the tree as well as those that cut it.
"""

from __future__ import annotations

import numpy as np
from exudyn_run import DENSE, IMPLICIT, driven, exu, integrate, item, stored
from trees import Link, Motion, Motor, Tree, mounted, springs_of, start_twists

from mechanisms import GROUND

SETTINGS = IMPLICIT
MOTION = ("Position", "RotationMatrix", "Velocity", "AngularVelocity")
START = ("Acceleration", "AngularAcceleration")


def turned(z: np.ndarray, x: np.ndarray | None = None) -> np.ndarray:
    """Rotation whose z axis is ``z`` and whose x axis is ``x``, or any at right angles."""
    z = z / np.linalg.norm(z)
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()]) if x is None else x
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


class Built:
    """The assembled system; ``sensors`` of the variables asked for, body by body."""

    def __init__(self, tree: Tree, variables: tuple[str, ...] = ()) -> None:
        self.tree, self.system = tree, exu.SystemContainer().AddSystem()
        self.ground = self.system.AddObject(item.ObjectGround(referencePosition=[0, 0, 0]))
        self.bodies = [self.body(*each) for each in zip(tree.links, *start_twists(tree), strict=True)]
        for k, link in enumerate(tree.links):
            self.joint(k, link)
        for c in tree.cuts:
            ends = self.ends(c.i, c.j, c.point, None if c.axis is None else turned(c.axis))
            kind = item.ObjectJointSpherical if c.axis is None else item.ObjectJointRevoluteZ
            self.system.AddObject(kind(markerNumbers=ends))
        for s in tree.springs:
            self.spring([self.marker(s.i, s.at_i), self.marker(s.j, s.at_j)], s.stiffness, s.damping, s.length)
        carried = [k for k, link in enumerate(tree.links) for _ in link.axes]
        for motor in tree.motors:
            self.motor(carried[motor.axis], motor)
        self.sensors = [self.sensor(body, what) for body in self.bodies for what in variables]
        self.system.Assemble()

    def body(self, link: Link, velocity: np.ndarray, spin: np.ndarray):
        """A rigid body at its centre of mass, with its weight."""
        J = np.asarray(link.inertia)
        start = {"initialVelocities": [*velocity, 0.0, *(0.5 * spin)]}
        node = self.system.AddNode(item.NodeRigidBodyEP(referenceCoordinates=[*link.centre, 1, 0, 0, 0], **start))
        six = [J[0, 0], J[1, 1], J[2, 2], J[1, 2], J[0, 2], J[0, 1]]
        body = self.system.AddObject(item.ObjectRigidBody(mass=link.mass, inertia=six, nodeNumber=node))
        marker = self.system.AddMarker(item.MarkerBodyMass(bodyNumber=body))
        self.system.AddLoad(item.LoadMassProportional(markerNumber=marker, loadVector=list(self.tree.gravity)))
        return body

    def marker(self, k: int, x: np.ndarray, R: np.ndarray | None = None):
        """At a point of a link, drawn at x; with axes if R is given."""
        body, local = (self.ground, x) if k == GROUND else (self.bodies[k], x - self.tree.links[k].centre)
        if R is None:
            return self.system.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localPosition=list(local)))
        place = np.eye(4)
        place[:3, :3], place[:3, 3] = R, local
        return self.system.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localHT=place))

    def ends(self, i: int, j: int, x: np.ndarray, R: np.ndarray | None) -> list:
        """Markers of a joint's two sides."""
        return [self.marker(i, x, R), self.marker(j, x, R)]

    def joint(self, k: int, link: Link) -> None:
        """A chain of hinges and slides as one joint; six freedoms are none.

        Raises
        ------
        ValueError
            If there is no such joint.
        """
        kinds, first = [a.kind for a in link.axes], link.axes[0]
        add = self.system.AddObject
        if kinds == ["hinge"]:
            ends = self.ends(link.parent, k, first.point, turned(first.direction))
            add(item.ObjectJointRevoluteZ(markerNumbers=ends))
            if first.stiffness or first.damping:
                connector = item.ObjectConnectorTorsionalSpringDamper
                add(connector(markerNumbers=ends, stiffness=first.stiffness, damping=first.damping))
        elif kinds == ["hinge", "hinge"]:  # one axis in each body, at right angles for good
            ends = self.ends(link.parent, k, first.point, turned(link.axes[1].direction, first.direction))
            add(item.ObjectJointGeneric(markerNumbers=ends, constrainedAxes=[1, 1, 1, 0, 1, 0]))
        elif kinds == ["slide"]:
            z = turned(first.direction)
            ends = self.ends(link.parent, k, first.point, z[:, [2, 0, 1]])
            add(item.ObjectJointPrismaticX(markerNumbers=ends))
            self.slide_spring(k, link)
        elif mounted(link):
            stiffness, damping = map(np.diag, springs_of(link))
            ends = self.ends(link.parent, k, first.point, np.eye(3))
            connector = item.ObjectConnectorRigidBodySpringDamper
            add(connector(markerNumbers=ends, stiffness=stiffness, damping=damping))
        elif len(kinds) != 6:
            raise ValueError(f"no joint of this engine is a chain of {kinds}")

    def slide_spring(self, k: int, link: Link) -> None:
        """The spring along a slide, between points so far apart that they never meet."""
        a = link.axes[0]
        if a.stiffness:
            ends = [self.marker(link.parent, a.point - a.direction), self.marker(k, a.point)]
            self.spring(ends, a.stiffness, 0.0, 1.0 + a.rest)

    def motor(self, k: int, motor: Motor) -> None:
        """About the hinge on which link k hangs."""
        link = self.tree.links[k]
        a = link.axes[0]
        R = turned(a.direction)
        ends = [self.marker(link.parent, a.point), self.marker(k, a.point)]
        connector = item.ObjectConnectorTorsionalSpringDamper
        number = self.system.AddObject(connector(markerNumbers=ends, rotationMarker0=R, rotationMarker1=R))
        driven(self.system, number, motor, "springTorqueUserFunction")

    def spring(self, ends: list, stiffness: float, damping: float, length: float) -> None:
        """Between two markers."""
        numbers = {"stiffness": stiffness, "damping": damping, "referenceLength": length}
        self.system.AddObject(item.ObjectConnectorSpringDamper(markerNumbers=ends, **numbers))

    def sensor(self, body, what: str):
        """Of the body's centre, storing."""
        kind = getattr(exu.OutputVariableType, what)
        place = {"bodyNumber": body, "localPosition": [0, 0, 0]}
        return self.system.AddSensor(item.SensorBody(**place, outputVariableType=kind, storeInternal=True))

    def run(self, t_end: float, steps: float, setting: str, samples: int) -> float:
        """CPU seconds."""
        dense, redundant = len(self.bodies) <= DENSE, self.tree.redundant
        return integrate(self.system, t_end, steps, setting, samples, dense=dense, redundant=redundant)


def solve(tree: Tree, t_end: float, steps: float, setting: str, samples: int = 0):
    """Integrate. Returns (motion, CPU seconds of the solver); no motion where samples is 0.

    Raises
    ------
    RuntimeError
        If the solver gives up.
    """
    built = Built(tree, MOTION if samples else ())
    seconds = built.run(t_end, steps, setting, samples)
    if not samples:
        return None, seconds
    data = stored(built.system, built.sensors, samples)
    p, R, v, w = (np.stack(data[n::4], axis=1) for n in range(4))
    return Motion(p, R.reshape(*R.shape[:2], 3, 3), v, w), seconds


def start_accelerations(tree: Tree) -> np.ndarray:
    """Acceleration of each centre and angular acceleration, (links, 6), a microsecond from the start."""
    built = Built(tree, START)
    built.run(1e-6, 1, "generalised-alpha 0.95", 1)
    data = stored(built.system, built.sensors, 1)
    return np.array([np.r_[a[0], b[0]] for a, b in zip(data[0::2], data[1::2], strict=True)])
