"""Force elements: one file each. A new force is a new file here and one line in ``equations/dispatch.py``."""

import importlib
import pkgutil
from typing import TYPE_CHECKING

from ..model.force import Force

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

ALL = [c for c in Force.registry.values() if issubclass(c, Force) and c.__module__.startswith(f"{__name__}.")]
"""Every force element that a file of this folder defines; all are public."""

globals().update({c.__name__: c for c in ALL})

if TYPE_CHECKING:  # for editors; nothing else needs these lines
    from .bushing import Bushing as Bushing
    from .coordinate_spring import Actuator as Actuator
    from .coordinate_spring import CoordinateSpring as CoordinateSpring
    from .joint_friction import JointFriction as JointFriction
    from .motor import Motor as Motor
    from .point_force import PointForce as PointForce
    from .point_torque import PointTorque as PointTorque
    from .rope import Rope as Rope
    from .spring_damper import SpringDamper as SpringDamper
    from .torsional_spring import TorsionalSpringDamper as TorsionalSpringDamper
