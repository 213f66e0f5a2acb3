"""Many runs of one model at different parameter values: the study, Sobol' indices, and study files.

`Study` contains the quantities of all runs. Its file is NetCDF; a fingerprint identifies the study, so that an
interrupted one can be continued from its file.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import AnalysisError, ModelError
from ..model.messages import listing, suggest
from ..model.model import Model
from ..model.model_files import dumps
from ..model.output_files import RESULT, TABLE, file_extension, write_file
from .files import OWN_GROUP, SLASH_SUBSTITUTE, is_sealed, sealed_file_bytes, text_type
from .result import Result
from .wording import json_numbers, range_text

if TYPE_CHECKING:
    import pandas
    import xarray


CONFIDENCE = 0.95  # confidence
RESAMPLES = 499  # bootstrap samples


@dataclass(frozen=True, repr=False)
class Indices:
    """Sobol' indices: parts of the variance of each quantity due to each parameter.

    Attributes
    ----------
    of, parameters : tuple of str
    samples : int
        Number of samples used: a power of two.
    left_out : int
        Number of samples left out because a run failed.
    first : ndarray (of, parameters) [1]
        First-order indices: mean relative reduction of the variance if the parameter were known.
    total : ndarray (of, parameters) [1]
        Total indices, with all interactions: mean relative variance left if all other parameters were known.
    first_range, total_range : ndarray (of, parameters, 2)
        Bounds of 95 % confidence, by resampling (BCa bootstrap); nan if nothing varies.
    """

    of: tuple[str, ...]
    parameters: tuple[str, ...]
    samples: int
    first: np.ndarray
    total: np.ndarray
    first_range: np.ndarray
    total_range: np.ndarray
    left_out: int = 0

    @classmethod
    def of_runs(cls, of: tuple[str, ...], parameters: tuple[str, ...], y: np.ndarray) -> Indices:
        """Compute the indices from y (of, 2 + parameters, samples), nan where a run failed.

        y contains the samples A, B, and A with one column of B each. SciPy's estimators require a power of two of
        samples: as many complete samples are used.
        """
        whole = np.isfinite(y).all(axis=(0, 1))
        left = int(whole.sum())
        if left < 2:
            raise AnalysisError(f"{left} of {len(whole)} samples have all their runs: no variances are known")
        y = y[:, :, whole][:, :, : 1 << (left.bit_length() - 1)]
        found = [_estimate_indices(x) for x in y]
        first, total, first_range, total_range = (np.array(x) for x in zip(*found, strict=True))
        return cls(of, parameters, y.shape[2], first, total, first_range, total_range, len(whole) - left)

    def __getitem__(self, of: str) -> dict[str, tuple[float, float]]:
        """Parameter -> (first, total) of a quantity."""
        k = self.of.index(of)
        pairs = zip(self.first[k].tolist(), self.total[k].tolist(), strict=True)
        return dict(zip(self.parameters, pairs, strict=True))

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        out = [("samples", f"{self.samples}; in brackets what 95 % of resamplings stay within")]
        if self.left_out:
            text = f"{self.left_out} samples of which a run failed: where that is so is missing from the indices"
            out.append(("left out", text))
        for i, name in enumerate(self.of):
            for k in np.argsort(-self.total[i], kind="stable"):
                parts = [
                    f"{what} {x[i, k]:.3f} [{r[i, k, 0]:.3f}, {r[i, k, 1]:.3f}]"
                    for what, x, r in (("first", self.first, self.first_range), ("total", self.total, self.total_range))
                ]
                out.append((name, f"{self.parameters[k]:<16} {', '.join(parts)}"))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        return {
            "samples": self.samples,
            "left_out": self.left_out,
            "of": {
                name: {
                    p: {
                        "first": float(self.first[i, k]),
                        "total": float(self.total[i, k]),
                        "first_range": json_numbers(self.first_range[i, k]),
                        "total_range": json_numbers(self.total_range[i, k]),
                    }
                    for k, p in enumerate(self.parameters)
                }
                for i, name in enumerate(self.of)
            },
        }

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Bars with their ranges; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.study_plots import indices

        return indices(self, path)

    def __repr__(self) -> str:
        return "\n".join(f"{a:<16} {b}" for a, b in self.lines())


def _estimate_indices(y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the indices of one quantity, and their bounds, by SciPy's estimators, for a power of two of samples."""
    import warnings

    from scipy.stats import sobol_indices

    d, n = len(y) - 2, y.shape[1]
    if not np.ptp(y) > 0.0:
        return np.zeros(d), np.zeros(d), np.full((d, 2), np.nan), np.full((d, 2), np.nan)
    found = sobol_indices(func={"f_A": y[:1], "f_B": y[1:2], "f_AB": y[2:, None, :]}, n=n)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the bounds are undefined for a parameter without effect
        spread = found.bootstrap(confidence_level=CONFIDENCE, n_resamples=RESAMPLES)
    ranges = [
        np.stack([np.ravel(x.confidence_interval.low), np.ravel(x.confidence_interval.high)], axis=1)
        for x in (spread.first_order, spread.total_order)
    ]
    return np.ravel(found.first_order), np.ravel(found.total_order), ranges[0], ranges[1]


STUDY_FORMAT = 1
RUN_DIMENSION, TIME_DIMENSION = "run", "time"
DOUBTFUL_ATTRIBUTES = {"comment": "1: done, but its tolerance may not be met"}
TEXTS_BY_RUN = ("reasons", "remarks", "doubtful")
"""Texts by the number of the run."""
STORED_FIELDS = (
    "name",
    "design",
    "parameters",
    "of",
    "units",
    "options",
    "base",
    "mark",
    "analysis",
    "seconds",
    "message",
)


def study_to_xarray(study: Study) -> xarray.Dataset:
    """See `Study.to_xarray`."""
    import xarray as xr

    dims: tuple[str, ...] = study.parameters if study.axes else (RUN_DIMENSION,)
    curve = any(x.ndim > 1 for x in study.values.values())
    coords: dict[str, Any] = {TIME_DIMENSION: (TIME_DIMENSION, study.t, {"units": "s"})} if curve else {}
    if study.axes:
        coords |= {name: (name, axis) for name, axis in zip(study.parameters, study.axes, strict=True)}
    else:
        coords |= {name: (RUN_DIMENSION, study.points[:, k]) for k, name in enumerate(study.parameters)}
    data: dict[str, Any] = {}
    for name, unit in zip(study.of, study.units, strict=True):
        x = study[name]
        data[name] = ((*dims, TIME_DIMENSION) if x.ndim > len(dims) else dims, x, {"units": unit} if unit else {})
    data["status"] = (dims, study.status.reshape(study.shape), {"comment": "0 still to be done, 1 done, 2 failed"})
    data["doubtful"] = (dims, _doubtful_flags(study).reshape(study.shape), DOUBTFUL_ATTRIBUTES)
    return xr.Dataset(data, coords, attrs=_dataset_attributes(study))


def _doubtful_flags(study: Study) -> np.ndarray:
    """Return which runs are doubtful, (runs,) of 0 and 1."""
    out = np.zeros(len(study), np.int8)
    out[list(study.doubtful)] = 1
    return out


def _dataset_attributes(study: Study) -> dict[str, str]:
    from .. import __version__

    return {"title": study.name, "source": f"flyball {__version__}", "comment": f"study, {study.design}"}


def save_study(study: Study, path: str | os.PathLike) -> None:
    """Write the study to one NetCDF file, through a temporary file that replaces an existing one."""
    write_file(path, sealed_file_bytes(lambda file: _write_study(study, file)))


def _write_study(study: Study, file: Any) -> None:
    texts = {k: getattr(study, k) for k in STORED_FIELDS}
    texts["options"] = {k: _option_data(x) for k, x in study.options.items()}
    texts |= {k: getattr(study, k) for k in TEXTS_BY_RUN}
    file.attrs.update(_dataset_attributes(study) | {"Conventions": "CF-1.11"})
    file.dimensions[RUN_DIMENSION], file.dimensions[TIME_DIMENSION] = len(study), len(study.t)
    file.create_variable(TIME_DIMENSION, (TIME_DIMENSION,), data=study.t).attrs["units"] = "s"
    for k, name in enumerate(study.parameters):
        file.create_variable(
            variable_name(f"parameter {name}"), (RUN_DIMENSION,), data=np.ascontiguousarray(study.points[:, k])
        )
    for (name, x), unit in zip(study.values.items(), study.units, strict=True):
        made = file.create_variable(
            variable_name(name), (RUN_DIMENSION, TIME_DIMENSION)[: x.ndim], data=np.ascontiguousarray(x)
        )
        made.attrs["units"] = unit or "1"
    file.create_variable("status", (RUN_DIMENSION,), data=study.status)
    file.create_variable("doubtful", (RUN_DIMENSION,), data=_doubtful_flags(study)).attrs.update(DOUBTFUL_ATTRIBUTES)
    group = file.create_group(OWN_GROUP)
    group.attrs["study"] = STUDY_FORMAT
    group.create_variable("study", (), dtype=text_type(), data=np.array(json.dumps(texts), object))
    for k, axis in enumerate(study.axes):
        group.dimensions[f"n_{k}"] = len(axis)
        group.create_variable(f"axis_{k}", (f"n_{k}",), data=axis)


def _option_data(x: Any) -> Any:
    return dataclasses.asdict(x) if dataclasses.is_dataclass(x) and not isinstance(x, type) else x


def variable_name(name: str) -> str:
    """Return a valid name of a variable of a file."""
    return name.replace("/", SLASH_SUBSTITUTE)


NOT_RUN, DONE, FAILED = 0, 1, 2
STATUS_TEXTS, DOUBTFUL_TEXT = ("still to be done", "done", "failed"), "done, but doubtful"
TIME_OPTIONS = {"motion": "outputs", "kinematics": "times"}  # analysis -> the option with its output times
MAX_TEXTS = 6  # number of reasons in a text
NOT_SALTELLI = "sensitivity indices need design='saltelli'; this is a study of design={!r}"


@dataclass(repr=False)
class Study:
    """Quantities of many runs, by the values of the parameters.

    ``study["max(slider.x)"]`` is a quantity of all runs: an array with an axis for each parameter of a grid, else one
    axis for the runs; for curves the last axis is time. nan if a run failed or is still to be done.

    Attributes
    ----------
    design : str
    parameters : tuple of str
        The varied parameters.
    analysis : str
        The analysis of each run.
    points : ndarray (runs, parameters)
        Their values in each run, in SI units; for a grid the last one changes first.
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
        Why completed runs may not satisfy their tolerance (`Health.doubtful`); also part of their remarks.
    options : dict
        How each run was computed.
    base : dict
        Values of the varied parameters in the model.
    start : Result or None
        Initial state of all runs.
    seconds : float
    message : str
        Why it ended prematurely; empty if it did not.
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
        """State of each run, (runs,) of str: done; done, but doubtful; failed; or still to be done."""
        out = np.array(STATUS_TEXTS, object)[self.status]
        out[list(self.doubtful)] = DOUBTFUL_TEXT
        return out.astype(str)

    @property
    def complete(self) -> bool:
        """Whether no run is still to be done."""
        return bool((self.status != NOT_RUN).all())

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
        """The arguments of the analysis that reproduce a run to the last bit: ``m.simulate(**study.question(17))``.

        For ``"kinematics"`` and ``"equilibrium"`` they are arguments of these methods; also for ``"modes"`` and
        ``"linearize"`` about the assembled position. About the equilibrium they are arguments of `equilibrium`, whose
        result is then passed as ``about=``. For ``"instant"`` they are arguments of `assemble`; for a user's function
        ``parameters`` only.
        """
        told = {k: x for k, x in self.options.items() if x not in (None, ()) and k != "about"}
        told["parameters"] = {**self.options["parameters"], **self.at(run)}
        if self.analysis in TIME_OPTIONS:
            told[TIME_OPTIONS[self.analysis]] = self.t.copy()
        if "about" in self.options and self.options["about"] is not None:
            told = {k: told[k] for k in ("t", "parameters")}
        return told | ({} if self.start is None else {"start": self.start})

    def indices(self, *of: str) -> Indices:
        """Return the Sobol' indices: the part of the variance of each quantity due to each parameter.

        They are computed by SciPy's ``sobol_indices``: first-order and total indices (Saltelli et al., Computer Physics
        Communications 181, 2010). A sample with a failed run is left out with all its runs, and `Indices.left_out`
        counts them.

        Parameters
        ----------
        of : str
            Quantities; all scalar ones if none is named.

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
            raise ModelError(NOT_SALTELLI.format(self.design))
        names = of or tuple(name for name in self.of if self.values[name].ndim == 1)
        if curves := [name for name in names if self[name].ndim > 1]:
            raise ModelError(f"{curves[0]} is a curve; give end({curves[0]}), or max, min, mean, rms of it")
        d = len(self.parameters)
        y = np.array([self.values[name] for name in names]).reshape(len(names), d + 2, -1)
        return Indices.of_runs(names, self.parameters, y)

    def lines(self) -> list[tuple[str, str]]:
        """Return a table: varied parameters, range of the quantities, and failed runs."""
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
            out.append((name, f"{range_text(self.points[:, k])} (in the model {self.base[name]:.6g})"))
        for name, unit in zip(self.of, self.units, strict=True):
            y = self.values[name][self.done]
            none = int((~np.isfinite(y)).sum()) if y.ndim == 1 else 0  # curves are missing if a motion ended before
            missed = [f"{none} of {len(y)} runs have no number"] if none else []
            y = y[np.isfinite(y)]
            if len(y):
                text = f"{range_text(y)} {unit.replace('*', ' ')}".rstrip()
                missed.insert(0, f"{text}, mean {y.mean():.6g}, standard deviation {y.std():.3g}")
            if missed:
                out.append((name, "; ".join(missed)))
        if any(name.startswith(("mean(", "rms(")) for name in self.of):
            out.append(("mean, rms", "over time by the trapezoidal rule between the output times"))
        remarks = {k: text for k, text in self.remarks.items() if text != self.doubtful.get(k)}
        out += self._text_lines("failed", self.reasons, "reasons")
        out += self._text_lines("doubtful", self.doubtful, "doubtful")
        return out + self._text_lines("remark", remarks, "remarks")

    def _text_lines(self, label: str, texts: dict[int, str], name: str) -> list[tuple[str, str]]:
        told = self._distinct_texts(texts)
        out = [(label, text) for text in told[:MAX_TEXTS]]
        return out + ([(label, f"and {len(told) - MAX_TEXTS} others: study.{name}")] if len(told) > MAX_TEXTS else [])

    def _distinct_texts(self, texts: dict[int, str]) -> list[str]:
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
            "values": {name: json_numbers(x) for name, x in self.values.items()},
            "status": self.status.tolist(),
            "reasons": {str(k): text for k, text in self.reasons.items()},
            "remarks": {str(k): text for k, text in self.remarks.items()},
            "doubtful": {str(k): text for k, text in self.doubtful.items()},
            "message": self.message,
        }

    def to_xarray(self) -> xarray.Dataset:
        """Return a labelled dataset: for a grid by the parameters, else by runs with the parameters as coordinates."""
        return study_to_xarray(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a table with a row for each run: parameters, and scalar quantities.

        ``attrs["doubtful"]`` are the numbers of doubtful runs.
        """
        import pandas as pd

        columns = {name: self.points[:, k] for k, name in enumerate(self.parameters)}
        columns |= {name: x for name, x in self.values.items() if x.ndim == 1}
        frame = pd.DataFrame(columns, index=pd.RangeIndex(len(self), name=RUN_DIMENSION))
        frame.attrs["units"] = dict(zip(self.of, self.units, strict=True))
        frame.attrs["doubtful"] = sorted(self.doubtful)
        return frame

    def to_csv(self, path: str | os.PathLike) -> None:
        """The table of `to_dataframe`; numbers are written exactly."""
        write_file(path, self.to_dataframe().to_csv(), TABLE)

    def save(self, path: str | os.PathLike) -> None:
        """Write it as one NetCDF file (.nc); ``flyball.load_study`` reads it back. A path in .csv: as by `to_csv`."""
        if file_extension(path, (*RESULT, *TABLE)) in TABLE:
            self.to_csv(path)
        else:
            save_study(self, path)

    def plot(self, *of: str, path: str | os.PathLike | None = None) -> Any:
        """Plot quantities over one parameter, as a surface over two, or scattered over each of more.

        Curves of few runs have a legend; those of up to 40 runs are coloured by the most influential parameter; for
        more runs the 50 % and 90 % ranges are drawn. Axes are logarithmic if values are distributed accordingly.
        Returns the Matplotlib figure, or writes it to ``path``.
        """
        from ..view.study_plots import study

        return study(self, of, path)

    def histogram(self, *of: str, path: str | os.PathLike | None = None) -> Any:
        """How often values of quantities occur; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.study_plots import histogram

        return histogram(self, of, path)

    def scatter(self, *of: str, path: str | os.PathLike | None = None) -> Any:
        """Quantities over each parameter, a point for each run; returns the figure, or writes it to ``path``."""
        from ..view.study_plots import scatter

        return scatter(self, of, path)

    def surface(self, of: str, x: str, y: str, path: str | os.PathLike | None = None) -> Any:
        """A quantity over two parameters as colours, the mean over others; the figure, or written to ``path``."""
        from ..view.study_plots import surface

        return surface(self, of, x, y, path)

    def __repr__(self) -> str:
        lines = self.lines()
        width = max(16, *(len(a) for a, _ in lines))
        return "\n".join(f"{a:<{width}} {b}" for a, b in lines)


STUDY_FILE_REMEDY = "give a file that a study with file= or Study.save wrote"


def study_fingerprint(
    model: Model,
    points: np.ndarray,
    options: Mapping[str, Any],
    quantities: Sequence[tuple[str, Callable | None]],
    times: np.ndarray,
) -> str:
    """Return a hash of all inputs of a study: two studies with the same hash have the same runs."""
    from .. import __version__

    digest = hashlib.sha256(f"{__version__}\n{dumps(model)}".encode())
    digest.update(repr(points.shape).encode() + points.tobytes() + times.tobytes())
    for title, function in quantities:
        digest.update(f"{title}\n".encode())
        if (code := getattr(function, "__code__", None)) is not None:
            digest.update(
                code.co_code + repr((code.co_names, [x for x in code.co_consts if not hasattr(x, "co_code")])).encode()
            )
    for name, x in sorted(options.items()):
        if isinstance(x, Result):
            digest.update(x.final[1].tobytes() + repr(x.final[0]).encode())
        elif name not in ("outputs", "progress"):
            digest.update(f"{name}={x!r}\n".encode())
    return digest.hexdigest()


def load_study_file(path: str | os.PathLike, mark: str | None = None) -> Study:
    """Read a study from its file; with ``mark``, the fingerprint of the study to be continued.

    Raises
    ------
    ModelError
        If the file is damaged, is not a study, or belongs to another one.
    """
    path = Path(path)
    if not path.exists():
        raise ModelError(f"there is no file {os.fspath(path)!r}; {STUDY_FILE_REMEDY}")
    try:
        whole = is_sealed(path)
    except OSError as error:
        raise ModelError(f"cannot read {os.fspath(path)!r}: {error.strerror or error}") from None
    if not whole:
        what = "is damaged: its contents do not match the checksum at its end" if whole is False else "is no study"
        raise ModelError(f"{path} {what}; {STUDY_FILE_REMEDY}")
    found = _read_study(path)
    if mark is not None and found.mark != mark:
        raise ModelError(
            f"{path} is of another study than this: model, values, quantities, options or the version of flyball are "
            f"not the same. Give another file, or remove that one"
        )
    return found


def _read_study(path: Path) -> Study:
    import h5netcdf

    with h5netcdf.File(path, "r") as file:
        group = file.groups.get(OWN_GROUP)
        kind = group.attrs.get("study") if group is not None else None
        if kind is None:
            if group is not None and "format" in group.attrs:
                raise ModelError(f"{path} is a result, no study: read it with flyball.load_result")
            raise ModelError(f"{path} is no study; {STUDY_FILE_REMEDY}")
        if int(kind) > STUDY_FORMAT:
            raise ModelError(f"{path} was written by a later version of flyball than this")
        text = group.variables["study"][()]
        told = json.loads(text.decode() if isinstance(text, bytes) else str(text))
        names = told["parameters"]
        columns = [file.variables[variable_name(f"parameter {name}")][...] for name in names]
        values = {name: np.ascontiguousarray(file.variables[variable_name(name)][...]) for name in told["of"]}
        axes = [group.variables[f"axis_{k}"][...] for k in range(len(names)) if f"axis_{k}" in group.variables]
        status = np.ascontiguousarray(file.variables["status"][...]).astype(np.int8)
        t = np.ascontiguousarray(file.variables[TIME_DIMENSION][...])
    for name in ("parameters", "of", "units"):
        told[name] = tuple(told[name])
    for name in TEXTS_BY_RUN:  # files of earlier versions have fewer
        told[name] = {int(k): x for k, x in told.get(name, {}).items()}
    if (status == NOT_RUN).any() and not told["message"]:
        told["message"] = "it ended before all runs were done"
    return Study(points=np.column_stack(columns), axes=tuple(axes), t=t, values=values, status=status, **told)
