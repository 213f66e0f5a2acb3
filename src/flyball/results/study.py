"""Many runs of one model at different values of its parameters."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.words import listing, suggest
from ..model.writing import RESULT, TABLE, ending, write
from .indices import Indices
from .numbers import plain, span
from .study_file import RUN, save_study, to_xarray

if TYPE_CHECKING:
    import pandas
    import xarray

    from .result import Result

WAITING, DONE, FAILED = 0, 1, 2
WORDS, DOUBTFUL = ("still to be done", "done", "failed"), "done, but doubtful"
TIMES = {"motion": "outputs", "kinematics": "times"}  # analysis -> the option that its output times are
TOLD = 6  # reasons in a text
NO_CROSS = "only the runs of design='saltelli' tell indices; this is a study of design={!r}"


@dataclass(repr=False)
class Study:
    """Quantities of many runs, by the values of the parameters.

    ``study["max(slider.x)"]`` is a quantity of all runs: an array with an axis for each parameter of a grid, else with
    one for the runs; behind it one for the times of a curve. nan where a run failed or is still to be done.

    Attributes
    ----------
    design : str
    parameters : tuple of str
        Those that were varied.
    analysis : str
        What each run is.
    points : ndarray (runs, parameters)
        Their values in each run, in SI units; of a grid the last one changes first.
    axes : tuple of ndarray
        Their values along each axis of a grid; empty for other designs.
    of, units : tuple of str
        The quantities, and their units.
    t : ndarray (n,) [s]
        Output times.
    values : dict of str to ndarray
        Each quantity, (runs,), or (runs, n) if it is a curve.
    status : ndarray (runs,) of int
        0: still to be done, 1: done, 2: failed.
    reasons : dict of int to str
        Why runs failed, by their numbers.
    remarks : dict of int to str
        What was noted about runs that are done.
    doubtful : dict of int to str
        Why runs that are done may not be what their tolerance asks for (`Health.doubtful`); it is among their remarks.
    options : dict
        How each run was computed.
    base : dict
        What the model says of the parameters that were varied.
    start : Result or None
        What all runs went on from.
    seconds : float
    message : str
        Why it ended before its time; empty if it did not.
    """

    name: str
    design: str
    parameters: tuple[str, ...]
    points: np.ndarray
    axes: tuple[np.ndarray, ...]
    of: tuple[str, ...]
    units: tuple[str, ...]
    t: np.ndarray
    values: dict[str, np.ndarray]
    status: np.ndarray
    options: dict[str, Any]
    base: dict[str, float]
    mark: str = ""
    analysis: str = "motion"
    reasons: dict[int, str] = field(default_factory=dict)
    remarks: dict[int, str] = field(default_factory=dict)
    doubtful: dict[int, str] = field(default_factory=dict)
    start: Result | None = None
    seconds: float = 0.0
    message: str = ""

    def __len__(self) -> int:
        """Number of runs."""
        return len(self.points)

    @property
    def done(self) -> np.ndarray:
        """Which runs are done and did not fail, (runs,)."""
        return self.status == DONE

    @property
    def words(self) -> np.ndarray:
        """How each run is, (runs,) of str: done; done, but doubtful; failed; or still to be done."""
        out = np.array(WORDS, object)[self.status]
        out[list(self.doubtful)] = DOUBTFUL
        return out.astype(str)

    @property
    def complete(self) -> bool:
        """Whether no run is still to be done."""
        return bool((self.status != WAITING).all())

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of values along the axes of a grid; else the number of runs."""
        return tuple(len(a) for a in self.axes) or (len(self),)

    def __getitem__(self, name: str) -> np.ndarray:
        """A quantity of all runs.

        Raises
        ------
        ModelError
            If there is none of that name.
        """
        found = self.values.get(name)
        if found is None:
            raise ModelError(f"the study has no {name!r}{suggest(str(name), self.of)}; {listing(list(self.of))}")
        return found.reshape(*self.shape, *found.shape[1:])

    def unit(self, name: str) -> str:
        """Unit of a quantity."""
        self[name]
        return self.units[self.of.index(name)]

    def at(self, run: int) -> dict[str, float]:
        """Values of the parameters in a run, for ``parameters=`` of any analysis.

        Raises
        ------
        ModelError
            If there is no such run.
        """
        if not -len(self) <= run < len(self):
            raise ModelError(f"there is no run {run}: they are numbered from 0 to {len(self) - 1}")
        return dict(zip(self.parameters, self.points[run].tolist(), strict=True))

    def question(self, run: int) -> dict[str, Any]:
        """What to ask the analysis for the same answer, to the last bit: ``m.simulate(**study.question(17))``.

        Of ``"kinematics"`` and ``"equilibrium"`` what to ask those; of ``"modes"`` and ``"linearize"`` where they are
        drawn too; about the equilibrium what to ask that one, which then is ``about=``. Of ``"instant"`` the question
        is for `assemble`, of a function of your own it has ``parameters`` alone.
        """
        told = {k: x for k, x in self.options.items() if x not in (None, ()) and k != "about"}
        told["parameters"] = {**self.options["parameters"], **self.at(run)}
        if self.analysis in TIMES:
            told[TIMES[self.analysis]] = self.t.copy()
        if "about" in self.options and self.options["about"] is not None:
            told = {k: told[k] for k in ("t", "parameters")}
        return told | ({} if self.start is None else {"start": self.start})

    def indices(self, *of: str) -> Indices:
        """Sobol' indices: which part of the variance of each quantity each parameter accounts for.

        By SciPy's ``sobol_indices``: first-order and total indices (Saltelli et al., Computer Physics Communications
        181, 2010). A sample of which one run failed is left out with all its runs, and `Indices.left_out` counts
        them.

        Parameters
        ----------
        of : str
            Quantities; all that are one number a run if none is named.

        Returns
        -------
        Indices

        Raises
        ------
        ModelError
            If the study has another design than ``saltelli``, or a quantity is a curve.
        AnalysisError
            If too few samples are left.
        """
        if self.design != "saltelli":
            raise ModelError(NO_CROSS.format(self.design))
        names = of or tuple(name for name in self.of if self.values[name].ndim == 1)
        if curves := [name for name in names if self[name].ndim > 1]:
            raise ModelError(f"{curves[0]} is a curve; ask for end({curves[0]}), or max, min, mean, rms of it")
        d = len(self.parameters)
        y = np.array([self.values[name] for name in names]).reshape(len(names), d + 2, -1)
        return Indices.of_runs(names, self.parameters, y)

    def lines(self) -> list[tuple[str, str]]:
        """A table for people: what was varied, how the quantities spread, and what failed."""
        done, failed = int(self.done.sum()), int((self.status == FAILED).sum())
        sizes = " x ".join(map(str, self.shape)) if self.axes else f"{len(self)} runs"
        what = "" if self.analysis == "motion" else f"{self.analysis}, "
        out = [("study", f"{self.name}, {what}{self.design}, {sizes}")]
        left = len(self) - done - failed
        doubted = f" ({len(self.doubtful)} of them doubtful)" if self.doubtful else ""
        told = [f"{done} done{doubted}"]
        told += [f"{n} {what}" for n, what in ((failed, "failed"), (left, "still to be done")) if n]
        out.append(("runs", ", ".join(told) + (f"; {self.message}" if self.message else "")))
        for k, name in enumerate(self.parameters):
            out.append((name, f"{span(self.points[:, k])} (in the model {self.base[name]:.6g})"))
        for name, unit in zip(self.of, self.units, strict=True):
            y = self.values[name][self.done]
            none = int((~np.isfinite(y)).sum()) if y.ndim == 1 else 0  # curves are none where a motion ended before
            missed = [f"{none} of {len(y)} runs have no number"] if none else []
            y = y[np.isfinite(y)]
            if len(y):
                text = f"{span(y)} {unit.replace('*', ' ')}".rstrip()
                missed.insert(0, f"{text}, mean {y.mean():.6g}, standard deviation {y.std():.3g}")
            if missed:
                out.append((name, "; ".join(missed)))
        if any(name.startswith(("mean(", "rms(")) for name in self.of):
            out.append(("mean, rms", "over time by the trapezoidal rule between the output times"))
        remarks = {k: text for k, text in self.remarks.items() if text != self.doubtful.get(k)}
        out += self._listed("failed", self.reasons, "reasons")
        out += self._listed("doubtful", self.doubtful, "doubtful")
        return out + self._listed("remark", remarks, "remarks")

    def _listed(self, label: str, texts: dict[int, str], name: str) -> list[tuple[str, str]]:
        told = self._told_of(texts)
        out = [(label, text) for text in told[:TOLD]]
        return out + ([(label, f"and {len(told) - TOLD} others: study.{name}")] if len(told) > TOLD else [])

    def _told_of(self, texts: dict[int, str]) -> list[str]:
        """Each text once, with the first run that has it and how many there are."""
        first: dict[str, int] = {}
        count: dict[str, int] = {}
        for k, text in sorted(texts.items()):
            first.setdefault(text, k)
            count[text] = count.get(text, 0) + 1
        out = []
        for text, k in first.items():
            at = ", ".join(f"{n} = {x:.6g}" for n, x in self.at(k).items())
            which = f"run {k}" if count[text] == 1 else f"{count[text]} runs, first {k}"
            out.append(f"{which} ({at}): {text}")
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        return {
            "name": self.name,
            "analysis": self.analysis,
            "design": self.design,
            "points": {name: self.points[:, k].tolist() for k, name in enumerate(self.parameters)},
            "t": self.t.tolist(),
            "units": dict(zip(self.of, self.units, strict=True)),
            "values": {name: plain(x) for name, x in self.values.items()},
            "status": self.status.tolist(),
            "reasons": {str(k): text for k, text in self.reasons.items()},
            "remarks": {str(k): text for k, text in self.remarks.items()},
            "doubtful": {str(k): text for k, text in self.doubtful.items()},
            "message": self.message,
        }

    def to_xarray(self) -> xarray.Dataset:
        """A labelled dataset: of a grid by the parameters, else by runs with the parameters as coordinates."""
        return to_xarray(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """A table with a row for each run: parameters, and the quantities that are one number.

        ``attrs["doubtful"]`` are the numbers of the runs that are.
        """
        import pandas as pd

        columns = {name: self.points[:, k] for k, name in enumerate(self.parameters)}
        columns |= {name: x for name, x in self.values.items() if x.ndim == 1}
        frame = pd.DataFrame(columns, index=pd.RangeIndex(len(self), name=RUN))
        frame.attrs["units"] = dict(zip(self.of, self.units, strict=True))
        frame.attrs["doubtful"] = sorted(self.doubtful)
        return frame

    def to_csv(self, path: str | os.PathLike) -> None:
        """The table of `to_dataframe`; numbers are written exactly."""
        write(path, self.to_dataframe().to_csv(), TABLE)

    def save(self, path: str | os.PathLike) -> None:
        """Write it as one NetCDF file (.nc); ``flyball.load_study`` reads it back. A path in .csv: as by `to_csv`."""
        if ending(path, (*RESULT, *TABLE)) in TABLE:
            self.to_csv(path)
        else:
            save_study(self, path)

    def plot(self, *of: str, path: str | os.PathLike | None = None) -> Any:
        """Quantities over one parameter, as a surface over two, or scattered over each of more.

        Curves of few runs are told by a legend, of up to 40 by the colour of the parameter that tells most of them; of
        more, what half and nine tenths of the runs stay within. Axes are logarithmic where values are spread so.
        Returns the Matplotlib figure, or writes it to ``path``.
        """
        from ..view.study import study

        return study(self, of, path)

    def histogram(self, *of: str, path: str | os.PathLike | None = None) -> Any:
        """How often values of quantities occur; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.study import histogram

        return histogram(self, of, path)

    def scatter(self, *of: str, path: str | os.PathLike | None = None) -> Any:
        """Quantities over each parameter, a point for each run; returns the figure, or writes it to ``path``."""
        from ..view.study import scatter

        return scatter(self, of, path)

    def surface(self, of: str, x: str, y: str, path: str | os.PathLike | None = None) -> Any:
        """A quantity over two parameters as colours, the mean over others; the figure, or written to ``path``."""
        from ..view.study import surface

        return surface(self, of, x, y, path)

    def __repr__(self) -> str:
        lines = self.lines()
        width = max(16, *(len(a) for a, _ in lines))
        return "\n".join(f"{a:<{width}} {b}" for a, b in lines)
