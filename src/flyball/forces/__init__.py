"""Force elements: one file each, found automatically. A new force is a new file here, and a line below for editors.

``KIND`` is the next number. ``inputs`` and ``wrench`` (or ``effort``), ``energy`` and all functions that they call
carry `formula`; a class without ``inputs`` inherits zeros. ``placed`` returns its frames if it is given by points; the
base classes have one, with the world's axes (pattern of another: `bushing`). ``on_points`` returns whether it may act
on a point mass. ``fails`` ends the message about a force that is no number: it says the
remedy; ``failure`` returns it, where it depends on the state. All compiled mechanics is compiled again. Samples in
tests: ``contract/test_forces.py``, ``robust/forces.py``, and in the mechanisms with every force of
``contract/test_everything.py`` and ``identities/test_complex_values.py``.
"""

import importlib
import pkgutil
from collections.abc import Callable
from typing import TYPE_CHECKING

from ..compiler.kernels import Signature
from ..constraints.registry import FRAME
from ..model.force import Force

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

_HERE = [c for c in Force.registry.values() if issubclass(c, Force) and c.__module__.startswith(f"{__name__}.")]
ALL = [c for c in _HERE if c.category == Force.category and hasattr(c, "kind")]
"""Every force element with a formula in a file of this folder; others consist of such elements. All are public."""
LIMITS = [c for c in _HERE if c.category != Force.category]
"""Every one-sided element: stops, play, latches. Elastic ones act by a formula, as forces do."""

globals().update({c.__name__: c for c in _HERE})


def formulas(elements: list[type[Force]], name: str) -> dict[int, Callable]:
    """Return kind -> formula of that name; elements of one kind share it.

    Raises
    ------
    RuntimeError
        If two elements have one kind and different formulas.
    """
    out: dict[int, Callable] = {}
    for c in elements:
        if (f := getattr(c, name, None)) is not None and out.setdefault(c.kind, f) is not f:
            homes = f"{out[c.kind].__module__} and {c.__module__}"
            raise RuntimeError(f"kind {c.kind} is taken twice: by {homes}; the next free is {_next_kind()}")
    return out


def _next_kind() -> int:
    return 1 + max(c.kind for c in _HERE if hasattr(c, "kind"))


INPUTS, WRENCHES, EFFORTS = (formulas(_HERE, name) for name in ("inputs", "wrench", "effort"))
WITH_STATES = formulas(_HERE, "wrench_and_rates")
"""Kind -> formula for the wrench of a force with two states, and the rates of these."""
BRANCHES = formulas(_HERE, "branch")
"""Kind -> formula for the branch of a force's rotation: four numbers and the speed [rad/s] of rotation.

The four numbers of two states within half a turn of each other have a positive product if both states are on one branch
of the formula.
"""
ENERGIES = formulas([c for c in _HERE if c.energy is not None], "energy")
"""Kind -> formula for the energy stored in a force."""
SIGNATURES = (
    Signature("inputs", "par, F, M", (16, FRAME, FRAME), 2, "two numbers: a quantity and its rate"),
    Signature(
        "wrench", "par, F, M, laws, values", (16, FRAME, FRAME, 3, 2), (3, 3), "(force, torque), each a tuple of three"
    ),
    Signature("effort", "par, x, rate, laws, load", (16, 0, 0, 3, 0), 0, "a number"),
    Signature("branch", "par, F, M", (16, FRAME, FRAME), 5, "five numbers"),
)
"""The formulas of forces that kernels call by address, in the order of their code tables."""
if set(WRENCHES) & set(EFFORTS):
    raise RuntimeError(
        f"kinds of forces are taken twice: {sorted(set(WRENCHES) & set(EFFORTS))}; the next free is {_next_kind()}"
    )
if TYPE_CHECKING:  # for editors and type checkers; nothing is imported here
    from .backlash import Backlash as Backlash
    from .bushing import Bushing as Bushing
    from .clutch import Brake as Brake
    from .clutch import Clutch as Clutch
    from .coordinate_spring import CoordinateSpring as CoordinateSpring
    from .detent import Detent as Detent
    from .engine_map import EngineMap as EngineMap
    from .gear_box import GearBox as GearBox
    from .joint_friction import JointFriction as JointFriction
    from .limit import Limit as Limit
    from .motor import Actuator as Actuator
    from .motor import Motor as Motor
    from .one_way import OneWay as OneWay
    from .one_way import Ratchet as Ratchet
    from .path_spring import PathSpring as PathSpring
    from .point_force import PointForce as PointForce
    from .point_torque import PointTorque as PointTorque
    from .rope import Rope as Rope
    from .rotor_inertia import RotorInertia as RotorInertia
    from .rubber import Rubber as Rubber
    from .shear_pin import ShearPin as ShearPin
    from .spring_damper import SpringDamper as SpringDamper
    from .torsional_spring import TorsionalSpringDamper as TorsionalSpringDamper
    from .tyre import Tyre as Tyre
    from .wheel_on_rail import WheelOnRail as WheelOnRail
