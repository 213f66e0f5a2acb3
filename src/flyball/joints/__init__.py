"""Joints and couplings: one file each. A new one is a new file here and one line below.

A joint is data: constraint rows (``blocks``, of `constraints.blocks`), relative coordinates (``coordinates``) and,
where it can be a tree joint, what it leaves free as a ``chain`` of primitive joints, slides first; blocks that the
chain does not fulfil are repeated in ``remaining_rows``, and ``rest`` has the axes of M in F at zero coordinates if
they are not parallel. Nothing is compiled for a new joint. ``world_frames`` places its frames where ``at`` and ``axis``
are not enough (pattern: `universal`), ``constants`` are numbers that rows compare with, ``symbol`` names its picture.
``replaceable``, ``stand_in`` and ``called`` offer it as a remedy for redundant constraints. ``one_surface`` must be
True where the coordinates are slips of one surface: friction along a second one is then refused; without it both act.
`model.joint.Joint` says what every such attribute means. Samples in tests: ``contract/zoo.py``, ``robust/joints.py``;
if its axes must be at right angles, also ``RIGHT_ANGLES`` of ``identities/test_complex_values.py``.

A coupling derives from `Coupling`: ``coupled()`` names coordinates of other joints, ``factors()`` their weights, or
``equation()`` gives a nonlinear relation.
Imports `constraints`, `math` and `model` only. Coordinates are zero in the reference configuration, not where axes of
bodies are parallel: links with arbitrary body frames would begin at odd angles.
"""

from .cam import Cam as Cam
from .constraint import Constraint as Constraint
from .coupler import Coupler as Coupler
from .cylindrical import Cylindrical as Cylindrical
from .distance import Distance as Distance
from .fixed import Fixed as Fixed
from .flat_faced_cam import FlatFacedCam as FlatFacedCam
from .gear_pair import GearPair as GearPair
from .general_universal import GeneralUniversal as GeneralUniversal
from .knife_edge import KnifeEdge as KnifeEdge
from .linear_actuator import LinearActuator as LinearActuator
from .orientation import Orientation as Orientation
from .planar import Planar as Planar
from .point_in_plane import PointInPlane as PointInPlane
from .point_on_curve import PointOnCurve as PointOnCurve
from .point_on_line import PinInSlot as PinInSlot
from .point_on_line import PointOnLine as PointOnLine
from .prismatic import Prismatic as Prismatic
from .rack_and_pinion import RackAndPinion as RackAndPinion
from .revolute import Revolute as Revolute
from .rolling import RollingBall as RollingBall
from .rolling import RollingDisk as RollingDisk
from .rope_span import RopeSpan as RopeSpan
from .screw import Screw as Screw
from .spherical import Spherical as Spherical
from .translational import Translational as Translational
from .universal import Universal as Universal
from .wheel_on_line import WheelOnLine as WheelOnLine
