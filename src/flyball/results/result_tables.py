"""Tables of all curves of a result: data frames, CSV, Parquet, and MATLAB's files."""

from __future__ import annotations

import csv
import io
import itertools
import os
import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.names import curve_parts
from ..model.output_files import MATLAB, PARQUET, TABLE, replacing_file
from .files import TIME_LABEL
from .wording import with_unit

if TYPE_CHECKING:
    import pandas

    from .result import Result

ROWS_AT_ONCE = 512  # rows of a table whose numbers are Python objects at the same time
MAX_FIELD_NAME = 63  # letters of a field of MATLAB


def to_dataframe(result: Result) -> pandas.DataFrame:
    """Return all curves as columns ``"slider.x"``; time [s] as index; units in ``attrs["units"]``."""
    import pandas as pd

    channels = result.channels()
    frame = pd.DataFrame({k: v for k, (_, v) in channels.items()}, index=pd.Index(result.t, name=TIME_LABEL))
    frame.attrs["units"] = {k: unit for k, (unit, _) in channels.items()}
    return frame


def to_csv(result: Result, path: str | os.PathLike) -> None:
    """Write all curves as a table with a header such as ``slider.x [m]``; numbers are written exactly."""
    channels = result.channels()
    header = [f"{TIME_LABEL} [s]", *(with_unit(k, unit) for k, (unit, _) in channels.items())]
    write_table(path, header, [result.t, *(v for _, v in channels.values())])


def write_table(
    path: str | os.PathLike, header: Sequence[str], columns: Sequence[np.ndarray], missing: str = "nan"
) -> None:
    """Write columns of numbers as a table (.csv), each with the fewest digits that are exact.

    ``missing`` is written for nan.
    """
    with replacing_file(path, TABLE) as file:
        line = io.StringIO()
        csv.writer(line).writerow(header)
        file.write(line.getvalue().encode())
        for k in range(0, len(columns[0]), ROWS_AT_ONCE):
            rows = np.stack([x[k : k + ROWS_AT_ONCE] for x in columns], axis=1)
            file.write(_csv_rows(rows, missing.encode()))


def _csv_rows(numbers: np.ndarray, missing: bytes) -> bytes:
    from pydantic_core import to_json

    text = to_json(numbers.tolist(), inf_nan_mode="constants")[2:-2].replace(b"],[", b"\r\n") + b"\r\n"
    return text if np.isfinite(numbers).all() else text.replace(b"NaN", missing).replace(b"Infinity", b"inf")


def to_parquet(result: Result, path: str | os.PathLike) -> None:
    """Write the data frame of all curves as a Parquet file, its units in the metadata.

    Raises
    ------
    ModelError
        If no package for Parquet is installed, or the file cannot be written.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise ModelError(
            f"cannot write {os.fspath(path)!r}: Parquet needs the package pyarrow: pip install 'flyball[parquet]'"
        ) from None
    frame = to_dataframe(result).reset_index()
    units = {TIME_LABEL: "s"} | frame.attrs["units"]
    columns = [pa.field(k, pa.float64(), metadata={"unit": units[k]}) for k in frame.columns]
    table = pa.Table.from_arrays([pa.array(frame[k]) for k in frame.columns], schema=pa.schema(columns))
    with replacing_file(path, PARQUET) as file:
        pq.write_table(table, file)


def to_mat(result: Result, path: str | os.PathLike) -> None:
    """Write all curves for MATLAB: ``t``, structs such as ``slider.x``, and their units in ``units.slider.x``.

    Letters that names in MATLAB do not have become ``_``.
    """
    from scipy.io import savemat

    out: dict[str, Any] = {"t": result.t}
    units: dict[str, dict[str, str]] = {}
    owners: dict[str, str] = {"t": "", "units": ""}
    for name, (unit, values) in result.channels().items():
        owner, what = curve_parts(name)
        field = next(f for f in _field_names(owner) if owners.setdefault(f, owner) == owner)
        out.setdefault(field, {})[_field_name(what)] = values
        units.setdefault(field, {})[_field_name(what)] = unit
    with replacing_file(path, MATLAB) as file:
        savemat(file, out | {"units": units}, long_field_names=True, oned_as="column")


def _field_name(name: str) -> str:
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return (plain if plain[:1].isalpha() else f"x{plain}")[:MAX_FIELD_NAME]


def _field_names(name: str) -> Iterator[str]:
    """Return possible names of a field, of which the first free one is used."""
    first = _field_name(name)
    yield first
    yield from (f"{first[: MAX_FIELD_NAME - 5]}_{k}" for k in itertools.count(2))
