"""flyball: rigid-body mechanisms, described once, analysed in every way an engineer asks for.

A guided map, by task; ``help(fb.Revolute)`` and the like say the rest. All results are in SI units and radians.

Describe a mechanism
    Mechanism     name, planar or spatial, gravity, parameters; ``m.add(...)`` takes the parts
    Body, Frame   what moves, and named axes on it; ``Body(shape=...)`` computes masses from
                  Box, Capsule, Cone, Cylinder, Ellipsoid, Hemisphere, Hull, Link, Mesh, Prism, Rod, Sphere,
                  Torus, Tube
    contact       Contact lets bodies touch by their shapes; Ground stands still, with Plane or HeightField as a
                  floor; Bodies are many equal ones in arrays; Material and MaterialPair say friction, restitution,
                  moving surfaces
    limits        Limit stops a coordinate, Backlash is play between some, OneWay a freewheel, Ratchet holds at teeth;
                  rigid or elastic, as Rope is; Detent (a force) has notches
    Event         what is done when a quantity passes zero: Stop, Set, Lock, Release, Impulse, Note
    joints        Revolute, Prismatic, Cylindrical, Spherical, Universal, GeneralUniversal, Fixed, Planar, Screw,
                  Translational, Orientation, Distance, PointOnLine, PinInSlot, PointInPlane, Cam, WheelOnLine,
                  RollingDisk, RollingBall, KnifeEdge
    couplings     GearPair, RackAndPinion, Coupler
    forces        SpringDamper, TorsionalSpringDamper, CoordinateSpring, Bushing, Rope, Detent, Actuator, Motor,
                  JointFriction, Clutch, Brake, PointForce, PointTorque
    controllers   PID, StateSpace, Transfer, Lag, Integrator, State: with states of their own; laws name them
    Driver        a coordinate follows a law of time; Initial says where it starts, Table is a curve for laws
    Sensor, IMU   measured quantities with names of their own
    load          read a mechanism from a TOML or Python file; ``m.save(path)`` writes one

Look before you run
    m             its repr says what is in it; in a notebook with a picture
    m.check()     -> Report: freedoms, redundant joints, assembly, masses
    m.mobility()  -> Mobility: freedoms and redundant sets by name, with cures
    m.assemble()  -> Assembly: positions that close; m.mass_properties() -> MassReport

Ask how it moves
    m.simulate(t_end)             -> Result: motion, reactions, energies, health; with contact by steps of impulses,
                                  of which method=Stepping(step=...) makes choices
    m.kinematics(times)           -> Result, where drivers prescribe the motion
    m.inverse_dynamics(times)     -> InverseDynamics: what drives must give, what joints carry
    m.singularities(driver, range) -> Singularities: where it locks up or branches
    m.compare(t_end)              -> Comparison of formulations of the equations of motion
    m.prepare()                   -> Prepared: mass matrix, accelerations, Jacobians on plain arrays, for any thread

Ask where it rests, and what small motions do
    m.equilibrium()               -> Equilibrium, stable or not, a Touch for each contact
    m.equilibria(parameter, values) -> EquilibriumSeries
    m.linearize(inputs, outputs)  -> LinearModel: A, B, C, D, Bode plots
    m.modes()                     -> Modes, animated; m.root_locus(parameter, values) -> RootLocus

Ask for the equations
    eq = m.symbolic(inputs)       -> Equations: M, f, g, G, gamma, reactions, energies, in the mechanism's own names
    print(eq), print(eq.M)        all of it, one of them: Expressions, simplified; eq.M.sympy(), .latex(), .at(values)
    L = eq.linear(outputs)        -> LinearEquations: A, B, C, D in the parameters; L.transfer_function() ->
                                  TransferFunction, L.routh() -> StabilityConditions
    eq.to_html(path)              an offline page; eq.to_latex(path) a file for pdflatex
    eq.explicit(independent)      -> ExplicitEquations: without constraints, closed forms where loops have some
    eq.state_space(outputs)       -> StateEquations: x' = f(x, u, t), y = h(x, u, t)
    m.export(folder, language)    -> Code: functions of the equations: language "c", "python", "casadi", "numba"

Ask what a number changes
    any analysis takes ``parameters={"rod": 0.6}``
    m.sensitivity(of, to)         -> Sensitivity: exact derivatives
    m.optimize(of, to)            -> Optimum: the values that fit best
    m.study(vary, of, t_end=...)  -> Study: many runs on all cores, grids and samples; study.indices() -> Indices

Read a result
    run["crank"].position, run["crank.x"], run["A"].force, run["A.force"], run["motor.effort"], run.energy.total
    run.names()                   every such name; ``run["<tab>`` and ``run["A"].<tab>`` complete them
    lines(), as_dict(), plot()    text, plain data and, of most results, a picture
    run.to_html(path)             one page that plays; run.to_report(path) adds plots and tables
    run.save(path)                load_result reads it back; also to_csv, to_dataframe, to_xarray; a study's file is
                                  read by load_study

When something is wrong
    FlyballError is the base of all errors: ModelError, UnitError and ExpressionError for what was written;
    AssemblyError, SimulationError, MobilityError, SingularityError, NotConverged and AnalysisError for what was asked.
    Interrupted has what was computed until the user ended it. StartWarning tells what of a
    described start could not be kept.

Elements of your own: ``help(fb.elements)``; ``fb.testing.check_element(e)`` tests one. Orientations by themselves:
``help(fb.rotations)``. From a shell: ``flyball --help``.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # for editors and type checkers: what `__getattr__` finds
    from . import elements as elements
    from . import rotations as rotations
    from . import testing as testing
    from .analysis.assembly.start import Assembly as Assembly
    from .analysis.motion.impulse.settings import Stepping as Stepping
    from .analysis.prepared import Prepared as Prepared
    from .analysis.study import load_study as load_study
    from .control.integrator import Integrator as Integrator
    from .control.lag import Lag as Lag
    from .control.pid import PID as PID
    from .control.state import State as State
    from .control.state_space import StateSpace as StateSpace
    from .control.transfer import Transfer as Transfer
    from .errors import AnalysisError as AnalysisError
    from .errors import AssemblyError as AssemblyError
    from .errors import ExpressionError as ExpressionError
    from .errors import FlyballError as FlyballError
    from .errors import Interrupted as Interrupted
    from .errors import MobilityError as MobilityError
    from .errors import ModelError as ModelError
    from .errors import NotConverged as NotConverged
    from .errors import PerformanceNotice as PerformanceNotice
    from .errors import SimulationError as SimulationError
    from .errors import SingularityError as SingularityError
    from .errors import SingularOrientationError as SingularOrientationError
    from .errors import SingularOrientationWarning as SingularOrientationWarning
    from .errors import StartWarning as StartWarning
    from .errors import UnitError as UnitError
    from .files import load as load
    from .files import load_result as load_result
    from .forces import *
    from .joints import *
    from .mechanism import Mechanism as Mechanism
    from .model.actions import Impulse as Impulse
    from .model.actions import Lock as Lock
    from .model.actions import Note as Note
    from .model.actions import Release as Release
    from .model.actions import Set as Set
    from .model.actions import Stop as Stop
    from .model.body import Body as Body
    from .model.body import Driver as Driver
    from .model.body import Frame as Frame
    from .model.body import Initial as Initial
    from .model.bulk import Bodies as Bodies
    from .model.contact import Contact as Contact
    from .model.event import Event as Event
    from .model.ground import Ground as Ground
    from .model.material import Material as Material
    from .model.material import MaterialPair as MaterialPair
    from .model.sensor import IMU as IMU
    from .model.sensor import Sensor as Sensor
    from .model.shapes import *
    from .model.table import Table as Table
    from .results.check import Report as Report
    from .results.comparison import Comparison as Comparison
    from .results.equilibria import EquilibriumSeries as EquilibriumSeries
    from .results.equilibrium import Equilibrium as Equilibrium
    from .results.indices import Indices as Indices
    from .results.inverse import InverseDynamics as InverseDynamics
    from .results.linear import LinearModel as LinearModel
    from .results.mass import MassReport as MassReport
    from .results.mobility import Mobility as Mobility
    from .results.modes import Modes as Modes
    from .results.optimum import Optimum as Optimum
    from .results.result import Result as Result
    from .results.root_locus import RootLocus as RootLocus
    from .results.sensitivity import Sensitivity as Sensitivity
    from .results.singularities import Singularities as Singularities
    from .results.study import Study as Study
    from .results.touch import Touch as Touch
    from .symbolic.equations import Equations as Equations
    from .symbolic.explicit.explicit import ExplicitEquations as ExplicitEquations
    from .symbolic.explicit.states import StateEquations as StateEquations
    from .symbolic.export.code import Code as Code
    from .symbolic.expressions import Expressions as Expressions
    from .symbolic.linear.equations import LinearEquations as LinearEquations
    from .symbolic.linear.routh import StabilityConditions as StabilityConditions
    from .symbolic.linear.transfer import TransferFunction as TransferFunction

__version__ = "0.4.0"

_HOME = {
    "Mechanism": "mechanism",
    "Body": "model.body",
    "Frame": "model.body",
    "Driver": "model.body",
    "Initial": "model.body",
    "Bodies": "model.bulk",
    "Contact": "model.contact",
    "Event": "model.event",
    "Impulse": "model.actions",
    "Lock": "model.actions",
    "Note": "model.actions",
    "Release": "model.actions",
    "Set": "model.actions",
    "Stop": "model.actions",
    "Stepping": "analysis.motion.impulse.settings",
    "Ground": "model.ground",
    "Material": "model.material",
    "MaterialPair": "model.material",
    "Sensor": "model.sensor",
    "IMU": "model.sensor",
    "Table": "model.table",
    "load": "files",
    "PerformanceNotice": "errors",
    "Interrupted": "errors",
    "StartWarning": "errors",
    "load_result": "files",
    "load_study": "analysis.study",
    "Result": "results.result",
    "FlyballError": "errors",
    "ModelError": "errors",
    "UnitError": "errors",
    "ExpressionError": "errors",
    "SingularOrientationError": "errors",
    "SingularOrientationWarning": "errors",
    "AnalysisError": "errors",
    "AssemblyError": "errors",
    "SimulationError": "errors",
    "MobilityError": "errors",
    "SingularityError": "errors",
    "NotConverged": "errors",
    "Assembly": "analysis.assemble",
    "Prepared": "analysis.prepared",
    "MassReport": "results.mass",
    "Mobility": "results.mobility",
    "Report": "results.check",
    "Comparison": "results.comparison",
    "Equilibrium": "results.equilibrium",
    "EquilibriumSeries": "results.equilibria",
    "Indices": "results.indices",
    "InverseDynamics": "results.inverse",
    "LinearModel": "results.linear",
    "Modes": "results.modes",
    "Optimum": "results.optimum",
    "RootLocus": "results.root_locus",
    "Sensitivity": "results.sensitivity",
    "Singularities": "results.singularities",
    "Study": "results.study",
    "Touch": "results.touch",
    "Code": "symbolic.export.code",
    "Equations": "symbolic.equations",
    "ExplicitEquations": "symbolic.explicit.explicit",
    "Expressions": "symbolic.expressions",
    "LinearEquations": "symbolic.linear.equations",
    "StabilityConditions": "symbolic.linear.routh",
    "StateEquations": "symbolic.explicit.states",
    "TransferFunction": "symbolic.linear.transfer",
}
_ROOMS = ("model.shapes", "joints", "forces", "control")
_MODULES = ("elements", "rotations", "testing")


def __getattr__(name: str) -> Any:
    """Public names are imported when first asked for: shapes, joints and forces from the folders that hold them."""
    if name == "__all__":
        return [k for k in __dir__() if not k.startswith("_")]
    if name in _HOME:
        return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
    if not name.startswith("_"):
        for room in _ROOMS:
            module = importlib.import_module(f".{room}", __name__)
            if hasattr(module, name) and isinstance(getattr(module, name), type):
                return getattr(module, name)
    from .model.words import suggest

    hint = "" if name.startswith("_") else suggest(name, __dir__())
    raise AttributeError(f"module 'flyball' has no attribute {name!r}{hint}")


def __dir__() -> list[str]:
    from .model.element import Element

    for room in _ROOMS:
        importlib.import_module(f".{room}", __name__)
    rooms = tuple(f"{__name__}.{room}." for room in _ROOMS)
    elements = [k for k, c in Element.registry.items() if c.__module__.startswith(rooms)]
    return sorted({*_HOME, *_MODULES, *elements, "__version__"} - {"Solid", "ConvexSolid", "Surface"})
