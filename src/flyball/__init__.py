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
    limits        Limit stops a coordinate, Backlash is play between some, OneWay a freewheel, Ratchet holds at teeth,
                  ShearPin breaks;
                  rigid or elastic, as Rope is; Detent (a force) has notches
    Event         what is done when a quantity passes zero: Stop, Set, Lock, Release, Impulse, Note
    joints        Revolute, Prismatic, Cylindrical, Spherical, Universal, GeneralUniversal, Fixed, Planar, Screw,
                  Translational, Orientation, Distance, PointOnLine, PinInSlot, PointInPlane, PointOnCurve, Cam,
                  FlatFacedCam, WheelOnLine, RollingDisk, RollingBall, KnifeEdge; LinearActuator: a cylinder, whose
                  length is a coordinate; RopeSpan: part of a Rope over pulleys
    couplings     GearPair, RackAndPinion, Coupler; Constraint: any equation of coordinates and time
    forces        SpringDamper, TorsionalSpringDamper, CoordinateSpring, PathSpring, Bushing, Rope, Detent,
                  Actuator, Motor, Rubber, RotorInertia, JointFriction, Clutch, Brake, PointForce, PointTorque,
                  WheelOnRail
    vehicles      Tyre on a Road; LinearTyre, FialaTyre, MagicFormula; RoadProfile, RandomRoad, OpenCRG; EngineMap,
                  GearBox; SpeedDriver, PathDriver
    controllers   PID, StateSpace, Transfer, Lag, Integrator, State: with states of their own; laws name them;
                  FMU: a unit of another program (FMI 2, 3);
                  ComputedTorque, GravityCompensatedPD: of a robot's joints, with its equations of motion
    Driver        a coordinate follows a law of time; Initial says where it starts, Table is a curve for laws,
                  Table2D a surface
    Sensor, IMU   measured quantities with names of their own
    vehicles      track: shoes around a sprocket with teeth, idler, road wheels on torsion bars; TrackWheel
    load          read a mechanism from a TOML or Python file, a robot in urdf; ``m.save(path)`` writes one

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
    m.live()                      a page in the browser with sliders, stepping, and bodies dragged with the mouse
    m.stepper(dt, inputs=...)     -> Stepper: advanced by a program outside, for control loops and learning
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
    m.fit(data, to)               -> Fit: values from measurements, with confidence intervals
    m.study(vary, of, t_end=...)  -> Study: many runs on all cores, grids and samples; study.indices() -> Indices

Read a result
    run["crank"].position, run["crank.x"], run["A"].force, run["A.force"], run["motor.effort"], run.energy.total
    run.names()                   every such name; ``run["<tab>`` and ``run["A"].<tab>`` complete them
    lines(), as_dict(), plot()    text, plain data and, of most results, a picture
    run.compare("test.csv")       -> MeasurementComparison with measured curves: deviations
    run.differences(other)        -> Differences of two motions: parameters, parts, curves, events, health
    run.spectrum("A.rate")        -> Spectrum: amplitudes and power spectral densities over frequency
    run.momentum("crank")         -> Momentum of bodies, groups or the whole: linear, and angular about any point
    run.to_html(path)             one page that plays; run.to_report(path) adds plots and tables
    run.save(path)                load_result reads it back; also to_csv, to_dataframe, to_xarray; a study's file is
                                  read by load_study

When something is wrong
    FlyballError is the base of all errors: ModelError, UnitError and ExpressionError for what was written;
    AssemblyError, SimulationError, MobilityError, SingularityError, NotConverged and AnalysisError for what was asked.
    Interrupted has what was computed until the user ended it. StartWarning tells what of a
    described start could not be kept, ModelWarning what of a robot's file is not used.

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
    from .assembly.assembled_state import Assembly as Assembly
    from .controllers.computed_torque import ComputedTorque as ComputedTorque
    from .controllers.fmu import FMU as FMU
    from .controllers.gravity_compensated_pd import GravityCompensatedPD as GravityCompensatedPD
    from .controllers.integrator import Integrator as Integrator
    from .controllers.lag import Lag as Lag
    from .controllers.path_driver import PathDriver as PathDriver
    from .controllers.pid import PID as PID
    from .controllers.speed_driver import SpeedDriver as SpeedDriver
    from .controllers.state import State as State
    from .controllers.state_space import StateSpace as StateSpace
    from .controllers.transfer import Transfer as Transfer
    from .errors import AnalysisError as AnalysisError
    from .errors import AssemblyError as AssemblyError
    from .errors import ExpressionError as ExpressionError
    from .errors import FlyballError as FlyballError
    from .errors import Interrupted as Interrupted
    from .errors import MobilityError as MobilityError
    from .errors import ModelError as ModelError
    from .errors import ModelWarning as ModelWarning
    from .errors import NotConverged as NotConverged
    from .errors import PerformanceNotice as PerformanceNotice
    from .errors import SimulationError as SimulationError
    from .errors import SingularityError as SingularityError
    from .errors import SingularOrientationError as SingularOrientationError
    from .errors import SingularOrientationWarning as SingularOrientationWarning
    from .errors import StartWarning as StartWarning
    from .errors import UnitError as UnitError
    from .forces import *
    from .forces.tyres import FialaTyre as FialaTyre
    from .forces.tyres import LinearTyre as LinearTyre
    from .forces.tyres import MagicFormula as MagicFormula
    from .joints import *
    from .kinematics.prepared import Prepared as Prepared
    from .mechanism import Mechanism as Mechanism
    from .mechanism import load as load
    from .mechanism import load_result as load_result
    from .model.body import Bodies as Bodies
    from .model.body import Body as Body
    from .model.body import Driver as Driver
    from .model.body import Frame as Frame
    from .model.body import Ground as Ground
    from .model.body import Initial as Initial
    from .model.contact import Contact as Contact
    from .model.contact import Material as Material
    from .model.contact import MaterialPair as MaterialPair
    from .model.controller import IMU as IMU
    from .model.controller import Sensor as Sensor
    from .model.event import Event as Event
    from .model.event import Impulse as Impulse
    from .model.event import Lock as Lock
    from .model.event import Note as Note
    from .model.event import Release as Release
    from .model.event import Set as Set
    from .model.event import Stop as Stop
    from .model.roads.opencrg import OpenCRG as OpenCRG
    from .model.roads.random_road import RandomRoad as RandomRoad
    from .model.roads.road import Road as Road
    from .model.roads.road import RoadProfile as RoadProfile
    from .model.shapes import *
    from .model.table import Table as Table
    from .model.table_2d import Table2D as Table2D
    from .results.comparison import Comparison as Comparison
    from .results.differences import Differences as Differences
    from .results.equilibrium import Equilibrium as Equilibrium
    from .results.equilibrium import EquilibriumSeries as EquilibriumSeries
    from .results.equilibrium import Touch as Touch
    from .results.inverse_dynamics import InverseDynamics as InverseDynamics
    from .results.linear_model import LinearModel as LinearModel
    from .results.measurements import MeasurementComparison as MeasurementComparison
    from .results.mechanism_report import MassReport as MassReport
    from .results.mechanism_report import Report as Report
    from .results.mobility import Mobility as Mobility
    from .results.modes import Modes as Modes
    from .results.modes import RootLocus as RootLocus
    from .results.momentum import Momentum as Momentum
    from .results.result import Result as Result
    from .results.sensitivity_and_optimum import Fit as Fit
    from .results.sensitivity_and_optimum import Optimum as Optimum
    from .results.sensitivity_and_optimum import Sensitivity as Sensitivity
    from .results.singularities import Singularities as Singularities
    from .results.spectrum import Spectrum as Spectrum
    from .results.study import Indices as Indices
    from .results.study import Study as Study
    from .simulation.integration_options import Stepping as Stepping
    from .simulation.stepper import Stepper as Stepper
    from .studies.study import load_study as load_study
    from .symbolic.equations import Equations as Equations
    from .symbolic.explicit.explicit_equations import ExplicitEquations as ExplicitEquations
    from .symbolic.explicit.explicit_equations import StateEquations as StateEquations
    from .symbolic.export import Code as Code
    from .symbolic.expressions import Expressions as Expressions
    from .symbolic.linear.linear_equations import LinearEquations as LinearEquations
    from .symbolic.linear.stability_conditions import StabilityConditions as StabilityConditions
    from .symbolic.linear.transfer_functions import TransferFunction as TransferFunction
    from .vehicles.track import TrackWheel as TrackWheel
    from .vehicles.track import track as track

__version__ = "0.4.0"

_HOME = {
    "Mechanism": "mechanism",
    "Body": "model.body",
    "Frame": "model.body",
    "Driver": "model.body",
    "Initial": "model.body",
    "Bodies": "model.body",
    "Contact": "model.contact",
    "Event": "model.event",
    "Impulse": "model.event",
    "Lock": "model.event",
    "Note": "model.event",
    "Release": "model.event",
    "Set": "model.event",
    "Stop": "model.event",
    "Stepping": "simulation.integration_options",
    "Ground": "model.body",
    "Material": "model.contact",
    "MaterialPair": "model.contact",
    "Sensor": "model.controller",
    "IMU": "model.controller",
    "Road": "model.roads.road",
    "RoadProfile": "model.roads.road",
    "RandomRoad": "model.roads.random_road",
    "OpenCRG": "model.roads.opencrg",
    "LinearTyre": "forces.tyres",
    "FialaTyre": "forces.tyres",
    "MagicFormula": "forces.tyres",
    "Table": "model.table",
    "Table2D": "model.table_2d",
    "load": "mechanism",
    "ModelWarning": "errors",
    "PerformanceNotice": "errors",
    "Interrupted": "errors",
    "StartWarning": "errors",
    "load_result": "mechanism",
    "load_study": "studies.study",
    "track": "vehicles.track",
    "TrackWheel": "vehicles.track",
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
    "Assembly": "assembly.assembled_state",
    "Stepper": "simulation.stepper",
    "Prepared": "kinematics.prepared",
    "MassReport": "results.mechanism_report",
    "MeasurementComparison": "results.measurements",
    "Mobility": "results.mobility",
    "Report": "results.mechanism_report",
    "Comparison": "results.comparison",
    "Differences": "results.differences",
    "Equilibrium": "results.equilibrium",
    "EquilibriumSeries": "results.equilibrium",
    "Indices": "results.study",
    "InverseDynamics": "results.inverse_dynamics",
    "LinearModel": "results.linear_model",
    "Modes": "results.modes",
    "Fit": "results.sensitivity_and_optimum",
    "Optimum": "results.sensitivity_and_optimum",
    "RootLocus": "results.modes",
    "Sensitivity": "results.sensitivity_and_optimum",
    "Singularities": "results.singularities",
    "Momentum": "results.momentum",
    "Spectrum": "results.spectrum",
    "Study": "results.study",
    "Touch": "results.equilibrium",
    "Code": "symbolic.export",
    "Equations": "symbolic.equations",
    "ExplicitEquations": "symbolic.explicit.explicit_equations",
    "Expressions": "symbolic.expressions",
    "LinearEquations": "symbolic.linear.linear_equations",
    "StabilityConditions": "symbolic.linear.stability_conditions",
    "StateEquations": "symbolic.explicit.explicit_equations",
    "TransferFunction": "symbolic.linear.transfer_functions",
}
_ROOMS = ("model.shapes", "joints", "forces", "controllers")
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
    from .model.messages import suggest_part

    hint = "" if name.startswith("_") else suggest_part(name, __dir__())
    raise AttributeError(f"module 'flyball' has no attribute {name!r}{hint}")


def __dir__() -> list[str]:
    from .model.element import Element

    for room in _ROOMS:
        importlib.import_module(f".{room}", __name__)
    rooms = tuple(f"{__name__}.{room}." for room in _ROOMS)
    elements = [k for k, c in Element.registry.items() if c.__module__.startswith(rooms)]
    return sorted(
        {*_HOME, *_MODULES, *elements, "__version__"} - {"Solid", "ConvexSolid", "Surface", "TyreModel", "ScaledTyre"}
    )
