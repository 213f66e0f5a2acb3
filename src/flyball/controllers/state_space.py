"""State space: x' = A x + B u, y = C x + D u, with any number of inputs and outputs.

It can be made from transfer functions and from systems of the python-control library.
"""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import BeforeValidator

from ..errors import ModelError
from ..model.controller import OUTPUT, Controller, ControlState, numbered_names, refuse_equal
from ..model.element import Law, Laws, Numbers, Unit, element, python_data
from ..model.expressions import number

Rows = list[list[float]]
DEFAULT_OUTPUT_NAME = re.compile(r"y\[\d+\]")
"""Default output names of python-control."""


def canonical_form(num: npt.ArrayLike, den: npt.ArrayLike, whose: str) -> tuple[Rows, Rows, Rows, Rows]:
    """A, B, C, D of a transfer function, coefficients from the highest power: the controllable canonical form.

    Raises
    ------
    ModelError
        If the numerator has a higher degree than the denominator.
    """
    a, b = (np.trim_zeros(np.array(x, float), "f") for x in (den, num))
    if not len(a):
        raise ModelError(f"{whose}: its denominator is zero")
    if len(b) > len(a):
        raise ModelError(
            f"{whose}: its numerator is of order {len(b) - 1}, its denominator of order {len(a) - 1}; a transfer "
            f"function that differentiates has no states: add a filter, a factor (1 + T s) in the denominator"
        )
    n = len(a) - 1
    b = np.r_[np.zeros(len(a) - len(b)), b] / a[0]
    a = a / a[0]
    A = np.vstack([-a[1:][None, :], np.eye(n)[:-1]]) if n else np.zeros((0, 0))
    C = (b[1:] - b[0] * a[1:])[None, :]
    return A.tolist(), np.eye(n)[:, :1].tolist(), C.tolist() if n else [], [[float(b[0])]]


def system_matrices(system: Any, name: str) -> dict[str, Any]:
    """Fields A, B, C, D of a `StateSpace` for a system of the python-control library, and its period if it has one.

    Raises
    ------
    ModelError
        If it is not such a system, or has several inputs or outputs as a transfer function.
    """
    whose = f"StateSpace {name!r}"
    if all(hasattr(system, k) for k in "ABCD"):
        if any(np.iscomplexobj(getattr(system, k)) for k in "ABCD"):
            raise ModelError(f"{whose}: its matrices are complex; take another basis of its states")
        found = [np.atleast_2d(np.asarray(getattr(system, k), float)) for k in "ABCD"]
        states = 0 if found[0].size == 0 else len(found[0])
        A, B, C, D = (M.tolist() if states or k == "D" else [] for k, M in zip("ABCD", found, strict=True))
    elif hasattr(system, "num") and hasattr(system, "den"):
        num, den = (_single_polynomial(getattr(system, k), whose) for k in ("num", "den"))
        A, B, C, D = canonical_form(num, den, whose)
    else:
        raise ModelError(
            f"{whose}: {type(system).__name__} is no linear system; give a control.StateSpace or a "
            f"control.TransferFunction"
        )
    out: dict[str, Any] = {"A": A, "B": B, "C": C, "D": D}
    dt = getattr(system, "dt", None)
    if dt is not None and dt is not True and dt > 0.0:
        out["period"] = float(dt)
    return out


def output_labels(system: Any) -> tuple[str, ...]:
    """Return the output labels of a python-control system as plain words; none if they are default names."""
    labels = [str(x) for x in getattr(system, "output_labels", None) or ()]
    if all(DEFAULT_OUTPUT_NAME.fullmatch(x) for x in labels):
        return ()
    return tuple(re.sub(r"^(?=\d)|\W", "_", x) for x in labels)


def _single_polynomial(coefficients: Any, whose: str) -> np.ndarray:
    """Return the only polynomial of a transfer function."""
    found = coefficients
    while len(found) and np.ndim(found[0]) > 0:
        if len(found) > 1:
            raise ModelError(f"{whose}: a transfer function of several inputs or outputs; give control.ss(system)")
        found = found[0]
    return np.asarray(found, float)


def _as_list(value: Any) -> Any:
    """Return a list; a single law becomes a list of one."""
    return (value,) if isinstance(value, (str, int, float)) or callable(value) else python_data(value)


def _as_matrix(value: Any) -> Any:
    """Return a matrix; a number or a single row becomes a matrix."""
    value = python_data(value)
    if isinstance(value, (int, float, str)):
        value = ((value,),)
    if isinstance(value, tuple) and value and not isinstance(value[0], tuple):
        value = (value,)
    return value


Matrix = Annotated[
    tuple[Numbers, ...],
    BeforeValidator(_as_matrix, json_schema_input_type=float | str | Numbers | tuple[Numbers, ...]),
]
"""Rows of numbers or expressions of parameters."""


@element
class StateSpace(Controller):
    """A linear system x' = A x + B u, y = C x + D u; sampled, with a period, x_(k+1) = A x_k + B u_k.

    Outputs are ``K.output``, or ``K.output1``, ``K.output2``, ... where there are several; a single output can also be
    named by the system's name alone. States are ``K.x1``, ``K.x2``, ...; of one only ``K.x``.

    Parameters
    ----------
    name : str
    inputs : list of expressions
        The signals u: expressions of ``t``, parameters, sensors, curves such as ``A.angle``, and controllers.
    A, B, C, D : matrices
        Rows of numbers, or of expressions of parameters. Without states only D is given: a matrix of gains.
    outputs : list of str, optional
        Names of the outputs.
    initial : list of numbers, optional
        Initial values of the states; zero if not given.
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...; outputs are constant in between.

    See Also
    --------
    StateSpace.from_control : of a system of the python-control library.
    """

    inputs: Annotated[Laws, BeforeValidator(_as_list, json_schema_input_type=Law | Laws)]
    A: Matrix = ()
    B: Matrix = ()
    C: Matrix = ()
    D: Matrix = ()
    outputs: tuple[str, ...] = ()
    initial: Annotated[Numbers, Unit(None)] = ()

    @classmethod
    def from_control(cls, name: str, system: Any, inputs: Any, **fields: Any) -> StateSpace:
        """A system of the python-control library, `control.StateSpace` or `control.TransferFunction`.

        Parameters
        ----------
        name : str
        system : control.StateSpace or control.TransferFunction
            Or anything that has A, B, C, D, or num and den, and dt.
        inputs : list of expressions
        fields
            As for `StateSpace`: outputs, in place of the system's own names (in which characters other than letters,
            digits and _ are replaced by _); initial; period of a discrete system that does not state one.

        Raises
        ------
        ModelError
            If it is not such a system.
        """
        given = system_matrices(system, name)
        if getattr(system, "dt", None) is True and "period" not in fields:
            raise ModelError(f"{cls.__name__} {name!r}: the system is discrete without a period; give period=...")
        if "period" in fields and "period" not in given and getattr(system, "dt", None) is not True:
            raise ModelError(f"{cls.__name__} {name!r}: the system is continuous; sample it: system.sample(period)")
        asked = fields.get("period", given.get("period"))
        if asked != given.get("period", asked):
            raise ModelError(
                f"{cls.__name__} {name!r}: the system's own period is {given['period']:g} s, and period={asked!r} is "
                f"given; leave period out, or sample the system anew"
            )
        return cls(name, inputs=inputs, **({"outputs": output_labels(system)} | fields | given))

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of states, inputs, outputs."""
        return len(self.A), len(self.inputs), len(self.D) or len(self.C)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Return the names as given, else output, or output1, output2, ..."""
        return self.outputs or numbered_names(OUTPUT, self.sizes[2])

    def check(self, n: SimpleNamespace) -> None:
        """Refuse matrices whose sizes do not fit."""
        super().check(n)
        states, inputs, outputs = self.sizes
        if not outputs or not inputs:
            raise ModelError(f"{self.title}: it has no {'outputs' if inputs else 'inputs'}; give C or D, and inputs")
        for name, rows, columns in (
            ("A", states, states),
            ("B", states, inputs),
            ("C", outputs if states else 0, states),
            ("D", outputs, inputs),
        ):
            M = getattr(self, name)
            if not M and (name == "D" or not rows):
                continue
            shape = {(len(M), len(row)) for row in M} or {(0, 0)}
            if shape != {(rows, columns)}:
                told = " or ".join(f"{a} x {b}" for a, b in sorted(shape))
                raise ModelError(
                    f"{self.title}: {name} is {told}; of {states} states, {inputs} inputs and {outputs} outputs it "
                    f"must be {rows} x {columns}"
                )
            for i, row in enumerate(M):
                for j, x in enumerate(row):
                    if not isinstance(x, str):
                        number(x, {}, None, f"{self.called(f'{name}_{i}_{j}')} of {self.title}")
        if self.outputs and len(self.outputs) != outputs:
            raise ModelError(f"{self.title}: it has {outputs} outputs, and {len(self.outputs)} names for them")
        refuse_equal(self, (*self.outputs, *numbered_names("input", inputs), *self._x))
        if self.initial and len(self.initial) != states:
            raise ModelError(f"{self.title}: it has {states} states, and {len(self.initial)} initial values")

    def given(self) -> dict[str, Any]:
        """Return inputs, and matrix entries that are expressions."""
        out: dict[str, Any] = {f"u_{j}": law for j, law in enumerate(self.inputs)}
        for name in "ABCD":
            for i, row in enumerate(getattr(self, name)):
                out |= {f"{name}_{i}_{j}": x for j, x in enumerate(row) if isinstance(x, str)}
        return out

    def called(self, given: str) -> str:
        """Return the name of a matrix entry or input."""
        name, *at = given.split("_")
        if name in "ABCD" and at:
            return f"row {int(at[0]) + 1}, column {int(at[1]) + 1} of {name}"
        return f"input {int(at[0]) + 1}" if name == "u" else given

    def _row(self, name: str, i: int, of: tuple[str, ...]) -> list[str]:
        """Return the terms of one row of a matrix times a vector."""
        M = getattr(self, name)
        out = []
        for j, x in enumerate(M[i] if M else ()):
            if isinstance(x, str):
                out.append(f"{name}_{i}_{j}*{of[j]}")
            elif x != 0.0:
                out.append(of[j] if x == 1.0 else f"({float(x)!r})*{of[j]}")
        return out

    @property
    def _x(self) -> tuple[str, ...]:
        return numbered_names("x", self.sizes[0])

    def signals(self) -> dict[str, str]:
        """Return the outputs and the inputs."""
        _, inputs, outputs = self.sizes
        u = tuple(f"u_{j}" for j in range(inputs))
        y = (" + ".join([*self._row("C", i, self._x), *self._row("D", i, u)]) or "0" for i in range(outputs))
        return dict(zip(self.output_names, y, strict=True)) | dict(zip(numbered_names("input", inputs), u, strict=True))

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return the states x."""
        u = tuple(f"u_{j}" for j in range(self.sizes[1]))
        laws = (" + ".join([*self._row("A", i, self._x), *self._row("B", i, u)]) or "0" for i in range(self.sizes[0]))
        initial = n.initial or (0.0,) * self.sizes[0]
        return tuple(ControlState(*x) for x in zip(self._x, laws, initial, strict=True))
