"""Files in: a mechanism from a model file, a result from a result file."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from .mechanism import Mechanism

if TYPE_CHECKING:
    from .results.result import Result


def load(path: str | os.PathLike) -> Mechanism:
    """Read a mechanism from a TOML model file, as `Mechanism.save` writes it.

    Raises
    ------
    ModelError
        If there is no such file or it describes no valid mechanism; the message names the file, the line and the
        element.
    """
    from .model.io import load

    return load(path, Mechanism)


def load_result(path: str | os.PathLike) -> Result:
    """Read a result from a NetCDF file, as `Result.save` writes it: nothing is simulated again, nothing compiled.

    Raises
    ------
    ModelError
        If there is no such file, or it is no result of flyball.
    """
    from .results.reading import load_result

    return load_result(path, Mechanism)
