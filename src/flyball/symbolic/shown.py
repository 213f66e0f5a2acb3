"""Equations shown: as text, LaTeX, page, in notebooks."""

from __future__ import annotations

import os
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

from ..errors import ModelError
from ..graph.values import written_out
from ..model.writing import LATEX, PAGE, write
from .document.document import document
from .document.parts import Document
from .document.plain import plain
from .document.typeset import typeset

if TYPE_CHECKING:
    from .equations import Equations


READABLE, WRITABLE = 1e7, 1e13  # symbols, written out: those of chains of 8 and of 22 links in joint coordinates


class Shown:
    """What every set of equations of motion does to be read."""

    @cached_property
    def document(self) -> Document:
        """Everything about the equations, short and in order: see `text`, `to_html` and `to_latex`.

        Raises
        ------
        ModelError
            If they are too large to be written for readers.
        """
        if self._written_out > WRITABLE:
            raise ModelError(f"the {self._too_large('a page')}")
        return document(cast("Equations", self))

    @cached_property
    def _written_out(self) -> int:
        """Symbols of the equations if nothing that recurs had a name."""
        eq = cast("Equations", self)
        return written_out(x for k in ("M", "f", "g", "G", "gamma") for x in getattr(eq, k).nodes.ravel())

    def _too_large(self, what: str) -> str:
        eq = cast("Equations", self)
        return (
            f"equations of {eq.model.name!r} are too large for {what}: {self._written_out:.2g} symbols if written out; "
            "print single ones (eq.M[0, 0], eq['energy.kinetic']), or take them as code: eq.export(folder)"
        )

    def text(self) -> str:
        """All of it as plain text: symbols, constraints, mass matrix, forces, equations of motion, energies."""
        return plain(self.document)

    def latex(self) -> str:
        """All of it as a LaTeX file of its own, for ``pdflatex``."""
        return typeset(self.document)

    def to_latex(self, path: str | os.PathLike) -> None:
        """Write the LaTeX file.

        Raises
        ------
        ModelError
            If the file cannot be written.
        """
        write(path, self.latex(), LATEX)

    def html(self) -> str:
        """All of it as one page that needs no network: browsers draw its formulas (MathML) by themselves."""
        from ..view.equations import page

        return page(self.document)

    def to_html(self, path: str | os.PathLike) -> None:
        """Write the page.

        Raises
        ------
        ModelError
            If the file cannot be written.
        """
        write(path, self.html(), PAGE)

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts: sizes, and the names of all symbols."""
        eq = cast("Equations", self)
        size = {k: getattr(eq, k).operations for k in ("M", "f", "g", "G", "gamma")}
        out = [
            ("coordinates", eq.coordinates),
            ("q", ", ".join(eq.q.rows)),
            ("v", ", ".join(eq.v.rows)),
            ("lam", ", ".join(eq.lam.rows) or "none: no constraints"),
            ("loads", ", ".join(eq.loads.rows)),
            ("places", ", ".join(eq.places)),
            ("inputs", ", ".join(eq.inputs)),
            ("parameters", ", ".join(f"{k} = {x:g}" for k, x in eq.parameters.items()) or "none"),
            ("operations", ", ".join(f"{k} {n}" for k, n in size.items())),
        ]
        return [(a, b) for a, b in out if b]

    def as_dict(self) -> dict[str, Any]:
        """Plain data: names, parameters, and the matrices as texts."""
        eq = cast("Equations", self)
        names = {k: list(getattr(eq, k).rows) for k in ("q", "v", "lam", "loads")}
        texts = {k: getattr(eq, k).texts() for k in ("M", "f", "g", "nu", "G", "gamma")}
        told = {"name": eq.model.name, "coordinates": eq.coordinates, "inputs": list(eq.inputs)}
        return told | names | {"parameters": eq.parameters} | texts

    def __str__(self) -> str:
        if self._written_out > READABLE:
            told = "\n".join(f"{label:<12} {text}" for label, text in self.lines())
            return f"{told}\nThe {self._too_large('the screen')}"
        return self.text()

    def _repr_html_(self) -> str:
        from ..view.notebook import iframe

        return iframe(self.html())
