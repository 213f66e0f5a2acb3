"""Packing of the equations in C as a functional mock-up unit: description, connecting code, compiler, archive."""

from __future__ import annotations

import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import uuid
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import numpy as np

from ...engine.entry_point import characteristic_rate_within
from ...errors import ModelError
from ...expression_graph.printers.routines import Routine
from ...model.output_files import write_file

if TYPE_CHECKING:
    from ..equations import Equations

VERSIONS = {"fmu": "3.0", "fmu2": "2.0"}
"""Version of the standard by the name of the language."""
FUNCTIONS = ("right_hand_side", "T", "M", "g", "nu", "G", "outputs")
"""Functions of the mechanism that a unit calls; those of constraints and outputs only if it has any."""
CONSTRAINTS = ("T", "M", "g", "nu", "G")
HERE = Path(__file__).parent
PLATFORMS = {  # system -> folder in FMI 2.0, in FMI 3.0, ending, options of the compiler
    "Linux": ("linux64", "{}-linux", ".so", ("-fPIC", "-shared")),
    "Darwin": ("darwin64", "{}-darwin", ".dylib", ("-fPIC", "-shared")),
    "Windows": ("win64", "{}-windows", ".dll", ("-shared",)),
}
TOLERANCE = 1e-6  # relative, of a step, if the importer gives none


@dataclass(frozen=True)
class Variable:
    """A variable of the unit.

    ``kind`` is ``time``, ``state``, ``rate``, ``input``, ``parameter`` or ``output``; ``of`` is the number of the state
    whose rate it is.
    """

    name: str
    kind: str
    unit: str = ""
    start: float | None = None
    nominal: float | None = None
    of: int | None = None
    is_output: bool = False


@dataclass(frozen=True)
class Unit:
    """Everything that the files of a unit are made of."""

    name: str
    title: str
    version: str
    routines: Mapping[str, Routine]
    variables: tuple[Variable, ...]
    sizes: Mapping[str, int]
    velocity_sizes: np.ndarray
    quaternions: tuple[int, ...]

    def of_kind(self, kind: str) -> list[Variable]:
        """Variables of one kind, in order."""
        return [v for v in self.variables if v.kind == kind]


def unit_of(name: str, title: str, language: str, routines: Sequence[Routine], start: Mapping[str, np.ndarray],
            outputs: Sequence[tuple[str, str]], eq: Equations) -> Unit:  # fmt: skip
    """Collect the variables of a unit.

    Parameters
    ----------
    name, title : str
        Identifier, and name of the mechanism.
    language : str
        One of `VERSIONS`.
    routines : sequence of Routine
        The functions `FUNCTIONS`.
    start : mapping
        Initial values of ``q``, ``v``, ``z``, ``u`` and ``p``.
    outputs : sequence of (name, unit)
    eq : Equations
        Of the mechanism, for natural sizes and quaternions.

    Raises
    ------
    ModelError
        If the mechanism has followers on curves, whose places a unit cannot integrate.
    """
    by_name = {r.name: r for r in routines}
    if "placesdot" in by_name["right_hand_side"].results:
        raise ModelError(f"{title!r} has followers on curves, which FMUs do not support; export it as language='c'")
    known = {a.name: a for r in routines for a in r.arguments}
    values = eq.named_equations.values
    length, rate = float(values.length), float(characteristic_rate_within(values.system))
    symbols = {k: known[k].nodes if k in known else [] for k in ("q", "v", "z", "u", "p")}
    sizes = {"q": lambda u: length if u == "m" else 1.0, "v": lambda u: rate * (length if u == "m/s" else 1.0)}
    states = [
        Variable(x.data.name, "state", x.data.unit, float(start[k][i]), sizes.get(k, lambda _: 1.0)(x.data.unit))
        for k in ("q", "v", "z")
        for i, x in enumerate(symbols[k])
    ]
    own = {name for name, _ in outputs}
    states = [replace(s, is_output=s.name in own) for s in states]
    mine = {s.name for s in states}
    variables = [Variable("time", "time", "s"), *states]
    variables += [Variable(f"der({s.name})", "rate", _rate_unit(s.unit), of=i) for i, s in enumerate(states)]
    for kind, k in (("input", "u"), ("parameter", "p")):
        variables += [Variable(x.data.name, kind, x.data.unit, float(start[k][i])) for i, x in enumerate(symbols[k])]
    variables += [Variable(n, "output", unit, is_output=True) for n, unit in outputs if n not in mine]
    counts = {k: len(symbols[k]) for k in symbols}
    counts |= {"y": len(variables) - 1 - 2 * len(states) - counts["u"] - counts["p"]}
    counts |= {"r": len(by_name["right_hand_side"].results["lam"])}
    metric = np.array([length if x.data.unit == "m/s" else 1.0 for x in symbols["v"]])
    place = {x.index: i for i, x in enumerate(symbols["q"])}
    turns = tuple(place[e[0].index] for e in eq.units)
    return Unit(name, title, VERSIONS[language], by_name, tuple(variables), counts, metric, turns)


def _rate_unit(unit: str) -> str:
    return {"": "1/s", "m": "m/s", "rad": "rad/s"}.get(
        unit, f"{unit.removesuffix('/s')}/s^2" if unit.endswith("/s") else ""
    )


def unit_files(x: Unit, sources: Mapping[str, str]) -> dict[str, str]:
    """Texts of all files of a unit but the compiled code: path in the archive -> text."""
    interface = "fmi2.c" if x.version == "2.0" else "fmi3.c"
    fixed = {k: (HERE / k).read_text(encoding="utf-8") for k in ("core.h", "core.c", interface)}
    text = "".join(sources.values()) + "".join(fixed.values()) + repr(x.variables)
    token = "{" + str(uuid.UUID(hashlib.sha256(text.encode()).hexdigest()[:32])) + "}"
    code = dict(sources) | _glue(x, token) | fixed
    describe = description_2 if x.version == "2.0" else description_3
    return {"modelDescription.xml": describe(x, token, sorted(k for k in code if k.endswith(".c")))} | {
        f"sources/{k}": v for k, v in code.items()
    }


def pack(name: str, version: str, files: Mapping[str, str], path: Path) -> None:
    """Compile and write the archive of a unit with this identifier and version of the standard.

    Raises
    ------
    ModelError
        If there is no C compiler, it fails, or the file cannot be written.
    """
    with TemporaryDirectory() as aside:
        folder = Path(aside)
        for file, text in files.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_text(text, encoding="utf-8")
        library = _compiled(name, version, folder)
        made = BytesIO()
        with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in (*files, library):
                entry = zipfile.ZipInfo(file)  # the same bytes at any time
                entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
                archive.writestr(entry, (folder / file).read_bytes())
    write_file(path, made.getvalue())


def _compiled(name: str, version: str, folder: Path) -> str:
    """Compile the sources; returns the path of the library in the archive."""
    compiler = shlex.split(os.environ.get("CC", "")) or [c for c in ("cc", "gcc", "clang") if shutil.which(c)][:1]
    system = platform.system()
    if not compiler or system not in PLATFORMS:
        raise ModelError("an FMU needs a C compiler: install gcc or clang, or name one by the environment variable CC")
    two, three, ending, options = PLATFORMS[system]
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    library = f"binaries/{two if version == '2.0' else three.format(machine)}/{name}{ending}"
    (folder / library).parent.mkdir(parents=True)
    c = sorted(str(p) for p in (folder / "sources").glob("*.c"))
    hidden = ("-std=c99", "-O2", "-fvisibility=hidden", "-ffp-contract=off")
    done = subprocess.run(
        [*compiler, *hidden, *options, *c, "-o", str(folder / library), "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise ModelError(f"the C compiler {compiler[0]!r} fails with the sources of the FMU: {done.stderr[:1000]}")
    return library


def _glue(x: Unit, token: str) -> dict[str, str]:
    """C code that connects `core.c` with the functions of the mechanism."""
    n = x.sizes
    head = [f"#define N{k.upper()} {v}" for k, v in n.items()] + [f'#define TOKEN "{token}"', ""]
    calls, bodies = [], []
    for name, given, results in (
        ("rates", "double t, const double *x, const double *u, const double *p", "double *rate"),
        ("outputs", "double t, const double *x, const double *u, const double *p", "double *y"),
        *((f, "const double *q, const double *p", f"double *{f}") for f in ("T", "M")),
        *((f, "double t, const double *q, const double *p", f"double *{f}") for f in ("g", "nu", "G")),
    ):
        routine = x.routines.get("right_hand_side" if name == "rates" else name)
        if name != "outputs" and (routine is None or (name in CONSTRAINTS and not n["r"])):
            continue
        calls.append(f"void call_{name}({given}, {results});")
        bodies.append(_call(x, name, f"void call_{name}({given}, {results})", routine))
    start, sizes = x.of_kind("state"), x.velocity_sizes
    arrays = {
        "start_states": [s.start for s in start],
        "start_parameters": [p.start for p in x.of_kind("parameter")],
        "state_sizes": [s.nominal for s in start],
        "velocity_sizes": sizes.tolist(),
    }
    declared = [f"extern const double {k}[{len(a) + 1}];" for k, a in arrays.items()]
    declared.append(f"extern const int quaternions[{len(x.quaternions) + 1}];")
    defined = [
        f"const double {k}[{len(a) + 1}] = {{{', '.join(repr(float(v)) for v in [*a, 0.0])}}};"
        for k, a in arrays.items()
    ]
    defined.append(f"const int quaternions[] = {{{', '.join(map(str, (*x.quaternions, -1)))}}};")
    guard = "#ifndef FLYBALL_FMU_GLUE_H\n#define FLYBALL_FMU_GLUE_H\n\n"
    return {
        "glue.h": guard + "\n".join([*head, *declared, "", *calls, "", "#endif", ""]),
        "glue.c": "\n".join([f'#include "glue.h"\n\n#include "{x.name}.h"\n', *defined, "", *bodies]),
    }


def _call(x: Unit, name: str, signature: str, routine: Routine | None) -> str:
    """Text of a function that calls a function of the mechanism."""
    if routine is None:  # no outputs besides states
        return f"{signature}\n{{\n}}\n"
    state = name in ("rates", "outputs")
    own = {"t": "t", "u": "u", "p": "p", "q": "x" if state else "q", "v": "x + NQ", "z": "x + NQ + NV"}
    arguments = [own[a.name] for a in routine.arguments]
    into, extra = {"qdot": "rate", "vdot": "rate + NQ", "zdot": "rate + NQ + NV"}, []
    results = []
    for key, a in routine.arrays.items():
        if state and name == "rates" and key not in into:
            extra.append(f"    double {key}[{max(a.size, 1)}];")
        results.append(into.get(key, key) if name == "rates" else signature.rpartition("*")[2][:-1])
    call = f"    {x.name}_{routine.name}({', '.join([*arguments, *results])});"
    return "\n".join([signature, "{", *extra, call, "}", ""])


def _root(x: Unit, token: str, identity: str) -> ET.Element:
    from ... import __version__

    own = {"fmiVersion": x.version, "modelName": x.title, identity: token, "generationTool": f"flyball {__version__}"}
    return ET.Element("fmiModelDescription", own | {"variableNamingConvention": "flat"})


def _add_units(root: ET.Element, x: Unit) -> None:
    units = dict.fromkeys(v.unit for v in x.variables if v.unit and v.kind != "time")
    if units:
        found = ET.SubElement(root, "UnitDefinitions")
        for unit in units:
            ET.SubElement(found, "Unit", name=unit)
    ET.SubElement(root, "DefaultExperiment", startTime="0", tolerance=repr(TOLERANCE))


def _attributes(v: Variable) -> tuple[dict[str, str], dict[str, str]]:
    """Attributes of causality, and of the number."""
    causality = {"state": "output" if v.is_output else "local", "rate": "local", "time": "independent"}.get(
        v.kind, v.kind
    )
    use = {"causality": causality, "variability": "fixed" if v.kind == "parameter" else "continuous"}
    if v.kind not in ("time", "input"):
        use["initial"] = "exact" if v.start is not None else "calculated"
    number = {"unit": v.unit} if v.unit and v.kind != "time" else {}
    if v.start is not None:
        number["start"] = repr(v.start)
    if v.nominal is not None:
        number["nominal"] = repr(v.nominal)
    return use, number


def description_2(x: Unit, token: str, sources: Sequence[str]) -> str:
    """The description of FMI 2.0."""
    root = _root(x, token, "guid")
    root.set("numberOfEventIndicators", "0")
    able = {"modelIdentifier": x.name, "canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"}
    for kind, more in (("ModelExchange", {}), ("CoSimulation", {"canHandleVariableCommunicationStepSize": "true"})):
        files = ET.SubElement(ET.SubElement(root, kind, able | more), "SourceFiles")
        for name in sources:
            ET.SubElement(files, "File", name=name)
    _add_units(root, x)
    variables, structure = ET.SubElement(root, "ModelVariables"), ET.SubElement(root, "ModelStructure")
    parts = {k: ET.SubElement(structure, k) for k in ("Outputs", "Derivatives", "InitialUnknowns")}
    for k, v in enumerate(x.variables):
        use, number = _attributes(v)
        if v.of is not None:
            number["derivative"] = str(v.of + 2)  # numbers begin with 1, which is the time
        ET.SubElement(
            ET.SubElement(variables, "ScalarVariable", {"name": v.name, "valueReference": str(k)} | use), "Real", number
        )
        for part, there in (
            ("Outputs", v.is_output),
            ("Derivatives", v.kind == "rate"),
            ("InitialUnknowns", v.kind in ("rate", "output")),
        ):
            if there:
                ET.SubElement(parts[part], "Unknown", index=str(k + 1))
    for empty in [p for p in parts.values() if not len(p)]:
        structure.remove(empty)
    return _text(root)


def description_3(x: Unit, token: str, sources: Sequence[str]) -> str:
    """The description of FMI 3.0."""
    root = _root(x, token, "instantiationToken")
    able = {"modelIdentifier": x.name, "canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
    ET.SubElement(root, "ModelExchange", able | {"needsCompletedIntegratorStep": "true"})
    ET.SubElement(root, "CoSimulation", able | {"canHandleVariableCommunicationStepSize": "true"})
    _add_units(root, x)
    variables, structure = ET.SubElement(root, "ModelVariables"), ET.SubElement(root, "ModelStructure")
    for k, v in enumerate(x.variables):
        use, number = _attributes(v)
        if v.of is not None:
            number["derivative"] = str(v.of + 1)
        ET.SubElement(variables, "Float64", {"name": v.name, "valueReference": str(k)} | use | number)
    for part, chosen in (
        ("Output", [v.is_output for v in x.variables]),
        ("ContinuousStateDerivative", [v.kind == "rate" for v in x.variables]),
        ("InitialUnknown", [v.kind in ("rate", "output") for v in x.variables]),
    ):
        for place in np.flatnonzero(chosen):
            ET.SubElement(structure, part, valueReference=str(place))
    return _text(root)


def _text(root: ET.Element) -> str:
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
