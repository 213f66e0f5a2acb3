"""Functional mock-up units of FMI 2 and 3 for co-simulation: their descriptions, and one instance for each motion.

The package fmpy reads the description and calls the unit's functions. Values have SI units outside this module.
"""

from __future__ import annotations

import atexit
import math
import os
import shutil
import threading
import zipfile
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from tempfile import mkdtemp
from typing import Any, NamedTuple
from xml.etree import ElementTree

from ..errors import ExpressionError, ModelError, SimulationError, UnitError
from ..model.controller import FunctionWithMemory
from ..model.messages import suggest
from ..model.units import powers_in_si, to_si

SAME_TIME = 1e-6  # relative to the period: times closer than this are one communication point
KEPT_MESSAGES = 3  # last messages of a unit that an error quotes
GROUP = 5  # values that one call of a function in a law passes besides the time
PERIOD = 0  # place of the period among the values given to a unit
FLOATING = ("Real", "Float64")
BASE_UNITS = {"kg": "kg", "m": "m", "s": "s", "A": "A", "K": "K", "mol": "mol", "cd": "cd", "rad": "rad"}
_CALLS = threading.RLock()  # fmpy changes the current folder while it loads a library


class UnitVariable(NamedTuple):
    """A variable of a unit: value in SI units = factor times its value + offset."""

    name: str
    reference: int
    causality: str
    variability: str
    initial: str
    factor: float
    offset: float
    unit: str  # in SI; empty if the unit states none, or one that is unknown
    fault: str  # why it cannot be used; empty if it can


@dataclass(frozen=True)
class UnitDescription:
    """What a unit says about itself."""

    file: str
    version: int
    token: str
    identifier: str
    once: bool  # whether a process may have one instance only
    variables: Mapping[str, UnitVariable]
    known_first: frozenset[str]  # outputs that do not depend on inputs of the same instant

    def names(self, causality: str) -> list[str]:
        """Return the names of usable variables of a causality."""
        return [k for k, v in self.variables.items() if v.causality == causality and not v.fault]

    def variable(self, name: str, role: str, title: str) -> UnitVariable:
        """Return a variable; refuse an unknown one, and one whose values are no real numbers."""
        if name not in self.variables:
            has = self.names(role) or list(self.variables)
            listed = ", ".join(has[:12]) + (", ..." if len(has) > 12 else "")
            raise ModelError(
                f"{title}: the unit has no variable {name!r}{suggest(name, self.variables)}; its {role}s are "
                f"{listed or 'none'}"
            )
        v = self.variables[name]
        if v.fault:
            raise ModelError(f"{title}: {name!r} {v.fault}; only single real variables can be connected")
        return v


def described(file: str, title: str) -> UnitDescription:
    """Read the description of a unit.

    Raises
    ------
    ModelError
        If the file is missing, is no unit for co-simulation by FMI 2 or 3, or has no code for this platform; or if the
        package fmpy is missing.
    """
    try:
        found = os.stat(file)
    except OSError:
        raise ModelError(f"{title}: there is no file {file!r}; give the path of an FMU (.fmu)") from None
    try:
        return _described(file, found.st_mtime_ns, found.st_size)
    except ModelError as error:
        raise ModelError(f"{title}: {error}") from None


@lru_cache(maxsize=64)
def _described(file: str, changed: int, size: int) -> UnitDescription:
    fmpy = _package()
    try:
        with zipfile.ZipFile(file) as archive:
            names = set(archive.namelist())
            text = archive.read("modelDescription.xml")
    except KeyError:
        raise ModelError(f"{file!r} is no FMU: the archive has no modelDescription.xml; export it again") from None
    except (OSError, zipfile.BadZipFile):
        raise ModelError(f"{file!r} is no FMU: it is no zip archive; export it again") from None
    try:
        version = str(ElementTree.fromstring(text).get("fmiVersion"))
        found = fmpy.read_model_description(file, validate=False) if version[:2] in ("2.", "3.") else None
    except Exception as error:  # fmpy raises plain exceptions for every kind of fault
        raise ModelError(f"the modelDescription.xml in {file!r} cannot be read: {error}; export it again") from None
    if found is None:
        raise ModelError(f"{file!r} is of FMI {version}; FMI 2 and 3 are supported: export it as one of these")
    if found.coSimulation is None:
        raise ModelError(
            f"{file!r} is for model exchange only, and an FMU is connected by co-simulation, in which it has its own "
            f"integrator; export it for co-simulation"
        )
    identifier = found.coSimulation.modelIdentifier
    folder = fmpy.platform if version[0] == "2" else fmpy.platform_tuple
    if f"binaries/{folder}/{identifier}{fmpy.sharedLibraryExtension}" not in names:
        there = sorted({n.split("/")[1] for n in names if n.startswith("binaries/") and n.count("/") > 1})
        code = any(n.startswith("sources/") for n in names)
        remedy = "compile its sources: fmpy compile FILE" if code else "export it for this platform"
        raise ModelError(
            f"{file!r} has no compiled code for this platform, {folder}; it has {', '.join(there) or 'none'}. {remedy}"
        )
    units = {u.name: u.baseUnit for u in found.unitDefinitions}
    variables = {v.name: _variable(v, units) for v in found.modelVariables}
    first = frozenset(x.variable.name for x in found.outputs if x.dependencies is not None and not x.dependencies)
    once = bool(found.coSimulation.canBeInstantiatedOnlyOncePerProcess)
    return UnitDescription(file, int(version[0]), found.guid, identifier, once, variables, first)


def _package() -> Any:
    try:
        import fmpy
        import fmpy.fmi2
        import fmpy.fmi3
    except ImportError:
        raise ModelError("an FMU needs the package fmpy: pip install 'flyball[fmu]'") from None
    return fmpy


def _variable(v: Any, units: Mapping[str, Any]) -> UnitVariable:
    declared = v.declaredType
    name = v.unit or (declared.unit if declared is not None else None) or ""
    factor, offset, unit = _in_si(name, units.get(name))
    fault = f"is of the type {v.type}" if v.type not in FLOATING else "is an array" if v.dimensions else ""
    causality, variability, initial = (str(x or "") for x in (v.causality, v.variability, v.initial))
    reference = int(v.valueReference)
    return UnitVariable(v.name, reference, causality, variability, initial, factor, offset, unit, fault)


def _in_si(name: str, base: Any) -> tuple[float, float, str]:
    """Return factor and offset to SI, and the SI unit: as the unit defines it, else by its name."""
    if base is not None:
        powers = {u: int(getattr(base, k)) for k, u in BASE_UNITS.items() if int(getattr(base, k))}
        return float(base.factor), float(base.offset), _unit_text(powers)
    name = name.replace(".", "*")
    try:
        return to_si(f"1 {name}", None), 0.0, _unit_text(powers_in_si(name))
    except UnitError:
        return 1.0, 0.0, ""


def _unit_text(powers: Mapping[str, float]) -> str:
    over = "*".join(f"{u}^{p:g}" if p != 1 else u for u, p in powers.items() if p > 0)
    under = "".join(f"/{u}^{-p:g}" if p != -1 else f"/{u}" for u, p in powers.items() if p < 0)
    return f"{over or '1'}{under}" if powers else ""


@dataclass(frozen=True)
class UnitCoupling:
    """How a unit takes part in a motion. Values given to it: the period, then ``parameters``, then ``inputs``."""

    title: str
    file: str
    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    tolerance: float | None

    @contextmanager
    def motion(self) -> Iterator[None]:
        """Context manager: the unit has an instance of its own for one motion, which is freed at the end.

        Raises
        ------
        SimulationError
            If the unit failed, and the motion went on since nothing depends on its outputs, or ended for a reason that
            does not name the unit.
        """
        running = _running().setdefault(self, [])
        own = UnitInstance(self)
        running.append(own)
        try:
            yield
        except SimulationError as error:
            if own.failed is None or str(own.failed) in str(error):
                raise
            raise SimulationError(f"{self.title}: {own.failed}", error.result, own.time) from error
        finally:
            running.remove(own)
            own.close()
        if own.failed is not None:
            raise SimulationError(f"{self.title}: {own.failed}", None, own.time)

    def instance(self) -> UnitInstance:
        """Return the instance of the motion that this thread computes."""
        if not (running := _running().get(self)):
            raise ExpressionError("an FMU has values only during a motion: simulate")
        return running[-1]


_THREAD = threading.local()


def _running() -> dict[UnitCoupling, list[UnitInstance]]:
    """Return the instances of the motions that this thread computes; the last of a unit is the current one."""
    if not hasattr(_THREAD, "running"):
        _THREAD.running = {}
    return _THREAD.running  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Given(FunctionWithMemory):
    """Function that passes values to a unit, from place ``first`` on; it returns the time that it is given."""

    memory: UnitCoupling
    first: int

    def __call__(self, t: float, *values: float) -> float:
        """Pass the values."""
        self.memory.instance().given.update(enumerate(values, self.first))
        return t


@dataclass(frozen=True)
class Read(FunctionWithMemory):
    """Function that returns an output of a unit at a time."""

    memory: UnitCoupling
    output: int

    def __call__(self, t: float) -> float:
        """Bring the unit to the time, and return the output there."""
        return self.memory.instance().read(self.output, t)


@dataclass(frozen=True)
class Time(FunctionWithMemory):
    """Function that returns the last communication point of a unit."""

    memory: UnitCoupling

    def __call__(self, t: float) -> float:
        """Bring the unit to the time, with the inputs there."""
        return self.memory.instance().communicate(t)


class UnitInstance:
    """One instance of a unit, for one motion."""

    def __init__(self, coupling: UnitCoupling) -> None:
        self.coupling = coupling
        self.given: dict[int, float] = {}
        self.known: dict[int, float] = {}  # values that the unit has been given
        self.unit: Any = None
        self.failed: ExpressionError | None = None
        self.time = self.first = 0.0
        self.steps = 0

    def read(self, output: int, t: float) -> float:
        """Return an output at time t [s], in SI units."""
        self.communicate(t)
        v = self.variables[self.coupling.outputs[output]]
        value = self._call(f"reading {v.name!r}", "get", v)
        if not math.isfinite(value):
            self._fail(f"its output {v.name!r} is {value} at t = {self.time:.6g} s; check its inputs and parameters")
        return v.factor * value + v.offset

    def communicate(self, t: float) -> float:
        """Bring the unit to time t [s], and pass the values given. Returns that time."""
        if self.failed is not None:
            raise self.failed
        if self.unit is None:
            self._start(t)
        else:
            self._advance(t)
        self._pass(len(self.coupling.parameters) + 1)
        return self.time

    def _start(self, t: float) -> None:
        c = self.coupling
        self.description = described(c.file, c.title)
        self.variables = self.description.variables
        self.time = self.first = t
        with _CALLS:
            if self.description.once and _ALIVE.get(c.file):
                self._fail(
                    "a process may have only one instance of it; use it once, and run motions one after the other"
                )
            adapter = Adapter2 if self.description.version == 2 else Adapter3
            try:
                self.unit = adapter(self.description, c.title)
            except Exception as error:  # fmpy raises plain exceptions
                self._fail(f"it cannot be loaded: {error}{_quoted()}")
            _ALIVE[c.file] = _ALIVE.get(c.file, 0) + 1
        self._pass(1, "before its initialisation")
        self._call("its initialisation", "initialize", t, c.tolerance)

    def _advance(self, t: float) -> None:
        period = self.given[PERIOD]
        count = (t - self.time) / period
        if count <= SAME_TIME:
            return
        if abs(count - round(count)) > SAME_TIME:
            self._step(t - self.time)
            self.time = self.first = t
            self.steps = 0
            return
        for _ in range(round(count)):
            self._step(period)
            self.steps += 1
            self.time = self.first + self.steps * period

    def _step(self, h: float) -> None:
        self._call(f"its step from t = {self.time:.6g} s over {h:.6g} s", "step", self.time, h)

    def _pass(self, first: int, when: str = "") -> None:
        """Pass the values from a place on that have changed; before the initialisation all that are given."""
        c = self.coupling
        names = ("", *c.parameters, *c.inputs)
        for k, value in sorted(self.given.items()):
            if k == PERIOD or self.known.get(k) == value:
                continue
            v = self.variables[names[k]]
            if k < first and v.variability != "tunable":
                self._fail(f"its parameter {v.name!r} changes during the motion, and the unit allows no change of it")
            self._call(f"giving it {v.name!r} = {value:.6g} {when}".rstrip(), "set", v, (value - v.offset) / v.factor)
            self.known[k] = value

    def _call(self, what: str, method: str, *args: Any) -> Any:
        _messages().clear()
        try:
            return getattr(self.unit, method)(*args)
        except Exception as error:  # fmpy raises plain exceptions
            self._fail(f"{what} fails: {error}{_quoted()}")

    def _fail(self, why: str) -> None:
        self.failed = ExpressionError(why)
        raise self.failed from None

    def close(self) -> None:
        """Terminate and free the instance, whatever happened to it."""
        if self.unit is None:
            return
        with _CALLS:
            unit, self.unit = self.unit, None
            _ALIVE[self.coupling.file] -= 1
            if self.failed is None:
                with suppress(Exception):  # the motion is complete, and the unit is left
                    unit.slave.terminate()
            with suppress(Exception):
                unit.slave.freeInstance()


_ALIVE: dict[str, int] = {}


class Adapter2:
    """Calls of a unit of FMI 2."""

    def __init__(self, d: UnitDescription, name: str) -> None:
        fmi2 = _package().fmi2
        self.slave = fmi2.FMU2Slave(**_loading(d, name))
        self.slave.instantiate(callbacks=_callbacks())

    def initialize(self, t: float, tolerance: float | None) -> None:
        """Initialise at time t [s]."""
        self.slave.setupExperiment(tolerance=tolerance, startTime=t)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def step(self, t: float, h: float) -> None:
        """Continue from time t over h [s]."""
        self.slave.doStep(t, h)

    def set(self, v: UnitVariable, value: float) -> None:
        """Set a variable."""
        self.slave.setReal([v.reference], [value])

    def get(self, v: UnitVariable) -> float:
        """Return a variable."""
        return float(self.slave.getReal([v.reference])[0])


class Adapter3:
    """Calls of a unit of FMI 3."""

    def __init__(self, d: UnitDescription, name: str) -> None:
        fmi3 = _package().fmi3
        self.slave = fmi3.FMU3Slave(**_loading(d, name))
        self.slave.instantiate(logMessage=_log_3)

    def initialize(self, t: float, tolerance: float | None) -> None:
        """Initialise at time t [s]."""
        self.slave.enterInitializationMode(tolerance=tolerance, startTime=t)
        self.slave.exitInitializationMode()

    def step(self, t: float, h: float) -> None:
        """Continue from time t over h [s]."""
        _, terminates, early, reached = self.slave.doStep(t, h)
        if terminates or early:
            raise RuntimeError(f"the unit ends {'the simulation' if terminates else 'its step'} at t = {reached:.6g} s")

    def set(self, v: UnitVariable, value: float) -> None:
        """Set a variable."""
        self.slave.setFloat64([v.reference], [value])

    def get(self, v: UnitVariable) -> float:
        """Return a variable."""
        return float(self.slave.getFloat64([v.reference])[0])


def _loading(d: UnitDescription, name: str) -> dict[str, Any]:
    found = os.stat(d.file)
    return {
        "guid": d.token,
        "modelIdentifier": d.identifier,
        "unzipDirectory": _extracted(d.file, found.st_mtime_ns, found.st_size),
        "instanceName": name,
        "requireFunctions": False,
    }


@lru_cache(maxsize=64)
def _extracted(file: str, changed: int, size: int) -> str:
    """Unpack a unit into a folder that is removed when the process ends; return the folder."""
    folder = mkdtemp(prefix="flyball-fmu-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    unwanted = ("sources/", "documentation/")
    _package().extract(file, folder, include=lambda name: not name.startswith(unwanted))
    return folder


def _messages() -> deque[str]:
    if not hasattr(_THREAD, "messages"):
        _THREAD.messages = deque(maxlen=KEPT_MESSAGES)
    return _THREAD.messages  # type: ignore[no-any-return]


def _quoted() -> str:
    said = "; ".join(_messages())
    return f". The unit reports: {said}" if said else ""


def _log_2(component: Any, name: Any, status: int, category: Any, message: bytes | None) -> None:
    _messages().append((message or b"").decode("utf-8", "replace"))


def _log_3(environment: Any, status: int, category: Any, message: bytes | None) -> None:
    _messages().append((message or b"").decode("utf-8", "replace"))


@lru_cache(maxsize=1)
def _callbacks() -> Any:
    """Return the functions that a unit of FMI 2 may call."""
    from ctypes import byref

    fmpy = _package()
    fmi2 = fmpy.fmi2
    made = fmi2.fmi2CallbackFunctions()
    made.logger = fmi2.fmi2CallbackLoggerTYPE(_log_2)
    made.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    made.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    with suppress(ImportError, OSError):  # without the proxy messages keep their format signs
        from fmpy.logging import addLoggerProxy

        addLoggerProxy(byref(made))
    return made
