"""Controllers: one file each, found automatically. A new controller is a new file here, and a line below for editors.

A controller declares signals and states as expressions; it imports `model` and `math` only. Continuous and sampled
controllers are the same classes, without or with a period.
"""

import importlib
import pkgutil
from typing import TYPE_CHECKING

from ..model.controller import Controller

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

_PLACE = f"{__name__}."
ALL = [c for c in Controller.registry.values() if issubclass(c, Controller) and c.__module__.startswith(_PLACE)]
"""Every controller defined in a file of this folder; all are public."""

globals().update({c.__name__: c for c in ALL})
if TYPE_CHECKING:  # for editors and type checkers; nothing is imported here
    from .computed_torque import ComputedTorque as ComputedTorque
    from .fmu import FMU as FMU
    from .gravity_compensated_pd import GravityCompensatedPD as GravityCompensatedPD
    from .integrator import Integrator as Integrator
    from .lag import Lag as Lag
    from .path_driver import PathDriver as PathDriver
    from .pid import PID as PID
    from .speed_driver import SpeedDriver as SpeedDriver
    from .state import State as State
    from .state_space import StateSpace as StateSpace
    from .transfer import Transfer as Transfer
