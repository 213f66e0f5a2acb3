"""Studies read back from their files, and what tells whether a file is of the same study."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.io import dumps
from ..model.model import Model
from .files import GROUP, sealed
from .result import Result
from .study import WAITING, Study
from .study_file import BY_RUN, FORMAT, TIME, safe

REMEDY = "give a file that a study with file= or Study.save wrote"


def fingerprint(
    model: Model,
    points: np.ndarray,
    options: Mapping[str, Any],
    asked: Sequence[tuple[str, Callable | None]],
    times: np.ndarray,
) -> str:
    """Hash of all that a study is asked: two with the same one have the same runs."""
    from .. import __version__

    digest = hashlib.sha256(f"{__version__}\n{dumps(model)}".encode())
    digest.update(repr(points.shape).encode() + points.tobytes() + times.tobytes())
    for title, function in asked:
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


def stored(path: str | os.PathLike, mark: str | None = None) -> Study:
    """Read a study from its file. With ``mark``: to go on with that study.

    Raises
    ------
    ModelError
        If the file is damaged, is no study, or is of another one.
    """
    path = Path(path)
    if not path.exists():
        raise ModelError(f"there is no file {os.fspath(path)!r}; {REMEDY}")
    try:
        whole = sealed(path)
    except OSError as error:
        raise ModelError(f"cannot read {os.fspath(path)!r}: {error.strerror or error}") from None
    if not whole:
        what = "is damaged: what it holds does not fit the checksum at its end" if whole is False else "is no study"
        raise ModelError(f"{path} {what}; {REMEDY}")
    found = _read(path)
    if mark is not None and found.mark != mark:
        raise ModelError(
            f"{path} is of another study than this: model, values, quantities, options or the version of flyball are "
            f"not the same. Give another file, or remove that one"
        )
    return found


def _read(path: Path) -> Study:
    import h5netcdf

    with h5netcdf.File(path, "r") as file:
        group = file.groups.get(GROUP)
        kind = group.attrs.get("study") if group is not None else None
        if kind is None:
            if group is not None and "format" in group.attrs:
                raise ModelError(f"{path} is a result, no study: read it with flyball.load_result")
            raise ModelError(f"{path} is no study; {REMEDY}")
        if int(kind) > FORMAT:
            raise ModelError(f"{path} was written by a later version of flyball than this")
        text = group.variables["study"][()]
        told = json.loads(text.decode() if isinstance(text, bytes) else str(text))
        names = told["parameters"]
        columns = [file.variables[safe(f"parameter {name}")][...] for name in names]
        values = {name: np.ascontiguousarray(file.variables[safe(name)][...]) for name in told["of"]}
        axes = [group.variables[f"axis_{k}"][...] for k in range(len(names)) if f"axis_{k}" in group.variables]
        status = np.ascontiguousarray(file.variables["status"][...]).astype(np.int8)
        t = np.ascontiguousarray(file.variables[TIME][...])
    for name in ("parameters", "of", "units"):
        told[name] = tuple(told[name])
    for name in BY_RUN:  # files of earlier versions have fewer
        told[name] = {int(k): x for k, x in told.get(name, {}).items()}
    if (status == WAITING).any() and not told["message"]:
        told["message"] = "it ended before all runs were done"
    return Study(points=np.column_stack(columns), axes=tuple(axes), t=t, values=values, status=status, **told)
