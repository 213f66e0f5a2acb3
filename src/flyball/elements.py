"""Base classes, field types and decorator for user-defined elements.

A force is a class decorated with `element` that derives from one of the base classes. Its formula is a static method:
``wrench(par, F, M, laws, values)`` of a `BodyForce`, `TwoPointForce` or `TwoFrameForce`, ``effort(par, x, rate, laws,
load)`` of a `CoordinateForce` or `JointForce`. A joint derives from `Joint` and lists its `blocks`: constraint rows of
flyball, or a `ConstraintRow` with a formula ``row(par, F, M)``. A shape derives from `ConvexSolid` and has a support
function ``support(par, d)``. An element that switches returns a `Switch` from `switches`; its kind is one of
`constraints.switches` or a `SwitchKind` of its own. `flyball.math.vec` and `flyball.math.scalar` contain the functions
that formulas may use. ``flyball.testing`` tests an element. `runge_kutta` defines a method of integration.
"""

from __future__ import annotations

from .compiler.formulas import formula as formula
from .constraints import blocks as blocks
from .constraints.blocks import ConstraintRow as ConstraintRow
from .constraints.displacement import point_row as point_row
from .constraints.displacement import seen_from as seen_from
from .constraints.switches.switch_kind import ProblemRow as ProblemRow
from .constraints.switches.switch_kind import SwitchKind as SwitchKind
from .model.element import Angle as Angle
from .model.element import Damping as Damping
from .model.element import Direction as Direction
from .model.element import Flag as Flag
from .model.element import Law as Law
from .model.element import LawOf as LawOf
from .model.element import Laws as Laws
from .model.element import Length as Length
from .model.element import Mass as Mass
from .model.element import Name as Name
from .model.element import Number as Number
from .model.element import Numbers as Numbers
from .model.element import Point as Point
from .model.element import PointPair as PointPair
from .model.element import Ratio as Ratio
from .model.element import Stiffness as Stiffness
from .model.element import Unit as Unit
from .model.element import Vector as Vector
from .model.element import Velocity as Velocity
from .model.element import element as element
from .model.element import nonnegative as nonnegative
from .model.element import positive as positive
from .model.force import BodyForce as BodyForce
from .model.force import CoordinateForce as CoordinateForce
from .model.force import JointForce as JointForce
from .model.force import Switch as Switch
from .model.force import TwoFrameForce as TwoFrameForce
from .model.force import TwoPointForce as TwoPointForce
from .model.force import Unilateral as Unilateral
from .model.joint import Coordinate as Coordinate
from .model.joint import Joint as Joint
from .model.shapes import ConvexSolid as ConvexSolid
from .numerics.integrators.butcher_tableaux import runge_kutta as runge_kutta
