"""A mechanism's equations as code: in memory, or as files of a folder."""

from __future__ import annotations

import keyword
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import ModelError
from ...graph.printers.c import c_sources
from ...graph.printers.casadi import casadi_functions
from ...graph.printers.naming import Names
from ...graph.printers.numba import numba_module
from ...graph.printers.python import python_functions, python_module, told_constants
from ...graph.printers.routine import Routine
from ...graph.printers.tables import opaque
from ...model.words import suggest
from ...model.writing import make_folder, write
from .functions import Functions
from .words import constants, head

if TYPE_CHECKING:
    from ..equations import Equations

LANGUAGES = ("c", "python", "casadi", "numba")


@dataclass(frozen=True)
class Code:
    """Functions of a mechanism as code.

    ``code["right_hand_side"]`` is one of them, to be called: a Python function for ``python`` and ``numba``, a
    ``casadi.Function`` for ``casadi``. C has to be compiled first.

    Attributes
    ----------
    language : {"c", "python", "casadi", "numba"}
    name : str
        What files are called, and what names in C begin with.
    texts : dict of str to str
        Name of a file -> what it holds; the functions of CasADi are files besides.
    operations : dict of str to int
        How many operations each function takes, what functions have in common counted in each.
    names : dict of str to tuple of str
        What the entries of each argument are: ``names["q"]``.
    start : dict of str to ndarray
        ``q`` and ``v`` as described and assembled, ``places`` on curves, values of the inputs ``u`` and parameters
        ``p``.
    files : tuple of Path
        Those that were written.
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
        """Write the files to a folder, which is made where it is not there; the same code, which names them."""
        folder = make_folder(folder)
        for name, text in self.texts.items():
            write(folder / name, text)
        written = [folder / name for name in self.texts]
        if self.language == "casadi":
            for name, f in self.functions.items():
                written.append(folder / f"{self.name}_{name}.casadi")
                with TemporaryDirectory() as aside:  # CasADi writes files by itself
                    f.save(str(Path(aside) / name))
                    write(written[-1], (Path(aside) / name).read_bytes())
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


def exported(
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
    _say_where(eq, routines)
    called = _identifier(name or eq.model.name, language)
    start = _start(eq, made)
    told, top = constants(eq, start), head(eq, language, routines)
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
        _ = code.functions  # what cannot be written is refused now
    return code if folder is None else code.written(folder)


def _start(eq: Equations, made: Functions) -> dict[str, np.ndarray]:
    """What state, places, inputs and parameters are at the start."""
    wanted = {p.symbol.data.name: p.symbol for p in eq.formulated.places}
    known = eq.checked(eq.start, wanted)
    values: dict[str, list[float]] = {
        k: [float(known[x.data.name]) for x in made.arguments[k].nodes]
        for k in ("q", "v", "places")
        if k in made.arguments
    }
    given = {k: list(made.arguments[k].values or ()) for k in ("u", "p") if k in made.arguments}
    return {k: np.array(x) for k, x in (values | given).items()}


def _say_where(eq: Equations, routines: Sequence[Routine]) -> None:
    """Tell Python functions whose laws they are."""
    laws = {id(c.native.python): c.where for c in eq.formulated.values.structure.functions}
    for _, f in opaque(routines, Names()).values():
        f.told["of"] = laws.get(id(f.python), "")


def _identifier(name: str, language: str) -> str:
    taken = [*keyword.kwlist, "numpy", "casadi", "numba", "math"] if language != "c" else ["math"]
    return Names(taken)(name.lower())


def _loader(routines: Sequence[Routine], name: str, top: str, told: Mapping[str, Sequence[Any]]) -> str:
    """A module that reads the functions of CasADi."""
    read = "".join(f'{r.name} = ca.Function.load(str(HERE / "{name}_{r.name}.casadi"))\n' for r in routines)
    imports = "from pathlib import Path\n\nimport casadi as ca\n"
    return f'"""{top}\n"""\n\n{imports}{told_constants(told)}\nHERE = Path(__file__).parent\n{read}'
