"""A mechanism's equations as code, in memory or as files of a folder: what `Mechanism.export` returns."""

from __future__ import annotations

import keyword
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import ModelError
from ...expression_graph.printers.c import c_sources
from ...expression_graph.printers.casadi import casadi_functions
from ...expression_graph.printers.numba import numba_module
from ...expression_graph.printers.python import constant_definitions, python_functions, python_module
from ...expression_graph.printers.routines import Identifiers, Routine, python_functions_of
from ...model.messages import suggest
from ...model.output_files import make_folder, write_file
from .functions import Functions

if TYPE_CHECKING:
    from ..equations import Equations


EQUATIONS = "qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma"

CALLING_CONVENTIONS = {
    "c": "Arguments and results are arrays of double, matrices row by row; results must be allocated by the caller. "
    "The functions have no static data, so threads may share them. Compile with a C99 compiler, link with -lm.",
    "python": "Arguments are numbers and sequences; arrays of states have the states' own axes first, and so have the "
    "results. NumPy is all that is needed.",
    "casadi": "Functions of SX; they take numbers, SX and MX. Matrices are matrices, several of them are stacked. "
    "The other files in this folder contain them.",
    "numba": "Arguments are floats and arrays of floats; one state at a time.",
}


def file_header(eq: Equations, language: str, routines: Sequence[Routine]) -> str:
    """Header comment of a file."""
    from ... import __version__

    told = [
        f"Functions of the mechanism {eq.model.name!r}, written by flyball {__version__}.",
        "",
        f"    {EQUATIONS}",
        "",
        *textwrap.wrap(
            "SI units and radians. World axes unless stated otherwise. Velocities v are rates of the coordinates q, "
            "but for bodies that turn freely: unit quaternions e0 to e3 (scalar first) in q, angular velocities w_x, "
            "w_y, w_z along the body's own axes in v. Reactions are G^T lam.",
            105,
        ),
        *textwrap.wrap(CALLING_CONVENTIONS[language], 105),
        "",
        f"Coordinates: {eq.coordinates}.",
    ]
    for name, items in argument_names(eq).items():
        if items:
            told += textwrap.wrap(f"{name} ({len(items)}): {', '.join(items)}", 105, subsequent_indent="    ")
    told += [f"{r.name}: {r.operations} operations" for r in routines]
    return "\n".join(told)


def argument_names(eq: Equations) -> dict[str, tuple[str, ...]]:
    """Names of the entries of each argument."""
    named = {k: getattr(eq, k).rows for k in ("q", "v", "z", "lam")}
    return named | {"u": eq.inputs, "p": tuple(eq.parameters)}


def argument_constants(eq: Equations, start: Mapping[str, np.ndarray]) -> dict[str, Sequence[object]]:
    """Names of the arguments' entries, and their initial values."""
    named = {f"{k}_names": x for k, x in argument_names(eq).items() if x}
    return named | {
        f"{k}_start" if k != "p" else "p_values": x.tolist() for k, x in start.items() if k != "u" and len(x)
    }


LANGUAGES = ("c", "python", "casadi", "numba")


@dataclass(frozen=True)
class Code:
    """Functions of a mechanism as code.

    ``code["right_hand_side"]`` is a callable function: a Python function for ``python`` and ``numba``, a
    ``casadi.Function`` for ``casadi``. C must be compiled first.

    Attributes
    ----------
    language : {"c", "python", "casadi", "numba"}
    name : str
        Name of the files, and prefix of names in C.
    texts : dict of str to str
        File name -> its text; the functions of CasADi are separate files.
    operations : dict of str to int
        Number of operations of each function; common operations count in each.
    names : dict of str to tuple of str
        Names of the entries of each argument: ``names["q"]``.
    start : dict of str to ndarray
        ``q``, ``v`` and controller states ``z`` as described and assembled, curve parameters ``places``, values of the
        inputs ``u`` and parameters ``p``.
    files : tuple of Path
        Files that were written.
    """

    language: str
    name: str
    texts: dict[str, str] = field(repr=False)
    operations: dict[str, int]
    names: dict[str, tuple[str, ...]] = field(repr=False)
    start: dict[str, np.ndarray] = field(repr=False)
    routines: tuple[Routine, ...] = field(repr=False)
    files: tuple[Path, ...] = ()

    @cached_property
    def functions(self) -> Mapping[str, Any]:
        """The functions by name.

        Raises
        ------
        ModelError
            If they are in C.
        """
        if self.language == "casadi":
            return casadi_functions(self.routines)
        if self.language == "python":
            return python_functions(self.routines)
        if self.language == "numba":
            space: dict[str, Any] = {}
            exec(compile(self.texts[f"{self.name}.py"], f"<{self.name}>", "exec"), space)
            return {r.name: space[r.name] for r in self.routines}
        raise ModelError("functions in C are called when they are compiled: write them to a folder")

    def __getitem__(self, name: str) -> Any:
        """A function by its name."""
        if name not in self.operations:
            raise ModelError(f"there is no function {name!r}{suggest(name, self.operations)} in this code")
        return self.functions[name]

    def written(self, folder: str | Path) -> Code:
        """Write the files to a folder, which is created if missing; returns the code with the file names."""
        folder = make_folder(folder)
        for name, text in self.texts.items():
            write_file(folder / name, text)
        written = [folder / name for name in self.texts]
        if self.language == "casadi":
            for name, f in self.functions.items():
                written.append(folder / f"{self.name}_{name}.casadi")
                with TemporaryDirectory() as aside:  # CasADi writes its files itself
                    f.save(str(Path(aside) / name))
                    write_file(written[-1], (Path(aside) / name).read_bytes())
        return replace(self, files=tuple(written))

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people."""
        told = [("language", self.language)]
        told += [(r.name, f"of {', '.join(a.name for a in r.arguments)}: {self.operations[r.name]} operations")
                 for r in self.routines]  # fmt: skip
        return told

    def as_dict(self) -> dict[str, Any]:
        """Plain data: language, operations, names and start."""
        return {
            "language": self.language,
            "name": self.name,
            "operations": self.operations,
            "names": {k: list(x) for k, x in self.names.items()},
            "start": {k: x.tolist() for k, x in self.start.items()},
            "files": [str(f) for f in self.files],
        }


def export_equations(
    eq: Equations,
    folder: str | Path | None = None,
    *,
    language: str = "c",
    functions: Sequence[str] = (),
    outputs: Sequence[str] = (),
    name: str = "",
) -> Code:
    """Equations as code, written to a folder if one is given: see `Mechanism.export`."""
    if language not in LANGUAGES:
        raise ModelError(f"language={language!r}: must be {', '.join(LANGUAGES)}{suggest(str(language), LANGUAGES)}")
    if isinstance(functions, str) or isinstance(outputs, str):
        raise ModelError("functions and outputs are lists of names")
    made = Functions(eq, outputs)
    routines = tuple(made.routine(k) for k in dict.fromkeys(functions or made.names))
    _annotate_functions(eq, routines)
    called = _identifier(name or eq.model.name, language)
    start = _start(eq, made)
    told, top = argument_constants(eq, start), file_header(eq, language, routines)
    if language == "c":
        sources = c_sources(routines, called, top, told)
        texts = {f"{called}.c": sources.source, f"{called}.h": sources.header}
    elif language == "casadi":
        for r in routines:
            r.check()
        texts = {f"{called}.py": _loader(routines, called, top, told)}
    else:
        texts = {f"{called}.py": (python_module if language == "python" else numba_module)(routines, top, told)}
    names = {a.name: tuple(x.data.name for x in a.nodes) for a in made.arguments.values()}
    code = Code(language, called, texts, {r.name: r.operations for r in routines}, names, start, routines)
    if language == "casadi":
        _ = code.functions  # refuses functions that cannot be written
    return code if folder is None else code.written(folder)


def _start(eq: Equations, made: Functions) -> dict[str, np.ndarray]:
    """Initial values of state, curve parameters, inputs and parameters."""
    wanted = {p.symbol.data.name: p.symbol for p in eq.named_equations.places}
    known = eq.checked(eq.start, wanted)
    values: dict[str, list[float]] = {
        k: [float(known[x.data.name]) for x in made.arguments[k].nodes]
        for k in ("q", "v", "z", "places")
        if k in made.arguments
    }
    given = {k: list(made.arguments[k].values or ()) for k in ("u", "p") if k in made.arguments}
    return {k: np.array(x) for k, x in (values | given).items()}


def _annotate_functions(eq: Equations, routines: Sequence[Routine]) -> None:
    """Record for Python functions which laws they belong to, for messages."""
    laws = {id(c.native.python): c.where for c in eq.named_equations.values.structure.functions}
    for _, f in python_functions_of(routines, Identifiers()).values():
        f.details["of"] = laws.get(id(f.python), "")


def _identifier(name: str, language: str) -> str:
    taken = [*keyword.kwlist, "numpy", "casadi", "numba", "math"] if language != "c" else ["math"]
    return Identifiers(taken)(name.lower())


def _loader(routines: Sequence[Routine], name: str, top: str, constants_text: Mapping[str, Sequence[Any]]) -> str:
    """Text of a module that loads the functions of CasADi."""
    read = "".join(f'{r.name} = ca.Function.load(str(HERE / "{name}_{r.name}.casadi"))\n' for r in routines)
    imports = "from pathlib import Path\n\nimport casadi as ca\n"
    return f'"""{top}\n"""\n\n{imports}{constant_definitions(constants_text)}\nHERE = Path(__file__).parent\n{read}'
