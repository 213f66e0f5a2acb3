"""Roads in OpenCRG files: heights on a grid along a reference line and across it (ASAM OpenCRG 1.2)."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from ...errors import ModelError
from ..element import element
from ..linked_files import FilePath, LinkedFile
from .road import RoadGrid, RoadSurface

CELL, CELLS = 10, 8  # characters of a number, and numbers in a line, of formatted data (LRFI)
NUMBER_TYPES = {"KRBI": ">f4", "KDBI": ">f8", "LRFI": "", "LDFI": ""}
SECTION = re.compile(r"(?:long section at v = *(\S+)|long section (\d+))", re.IGNORECASE)
CHANNEL = re.compile(r"D:([^,]*)", re.IGNORECASE)
VIRTUAL = re.compile(r"U:reference line u *,? *m? *, *([^,]+), *([^,]+)", re.IGNORECASE)


@element
class OpenCRG(LinkedFile, RoadSurface):
    """A road in an OpenCRG file (``.crg``): measured or made heights along a straight or curved line.

    The line begins at the place and heading that the file gives, in the road's own frame (usually the origin, along x).
    Slope and banking of the line are added to the heights. Heights are interpolated by a bicubic spline, not linearly
    between points. Where heights are missing there is no road. Text and binary files are read.

    Parameters
    ----------
    name : str
        Optional.
    path : str
        The file. A relative path refers to the folder of the model file, or to the current folder.
    """

    path: FilePath

    __eq__, __hash__ = LinkedFile.__eq__, LinkedFile.__hash__

    @property
    def title(self) -> str:
        """Kind and file, for messages."""
        return f"OpenCRG {self.name or self.path!r}"

    def check(self, n: SimpleNamespace) -> None:
        """Read the file."""
        self.grid()

    def grid(self) -> RoadGrid:
        """Return its heights.

        Raises
        ------
        ModelError
            If the file cannot be read, or its line crosses itself.
        """
        file = str(self.file)
        try:
            changed = Path(file).stat().st_mtime_ns
        except OSError as error:
            raise ModelError(f"{self.title}: {file} cannot be read: {error.strerror}; is the path right?") from None
        return _read(file, changed, self.title)


@lru_cache(maxsize=8)
def _read(file: str, changed: int, who: str) -> RoadGrid:
    raw = Path(file).read_bytes()
    end = re.search(rb"^\$\$\$\$.*?\r?\n", raw, re.MULTILINE)
    if end is None:
        raise ModelError(f"{who}: {file} has no line $$$$ that ends its header, so it is no OpenCRG file")
    header = raw[: end.start()].decode("latin-1")
    values = dict(re.findall(r"^\s*([A-Z_]+)\s*=\s*(\S+)", _section(header, "ROAD_CRG"), re.MULTILINE))
    numbers = {k: float(x) for k, x in values.items() if re.fullmatch(r"[-+.\dEe]+", x)}
    definition = _section(header, "KD_DEFINITION")
    form = re.search(r"^#:(\w{4})", definition, re.MULTILINE)
    if form is None or form[1].upper() not in NUMBER_TYPES:
        known = ", ".join(NUMBER_TYPES)
        raise ModelError(f"{who}: its data format is {form[1] if form else 'missing'}; it must be one of {known}")
    names = [x.strip() for x in CHANNEL.findall(definition)]
    data = _data(raw[end.end() :], NUMBER_TYPES[form[1].upper()], len(names), who)
    virtual = VIRTUAL.search(definition)
    step = float(virtual[2]) if virtual else numbers.get("REFERENCE_LINE_INCREMENT", 0.0)
    if not step > 0.0:
        raise ModelError(f"{who}: its reference line has no increment; the header must give REFERENCE_LINE_INCREMENT")
    first = numbers.get("REFERENCE_LINE_START_U", float(virtual[1]) if virtual else 0.0)
    sections = [k for k, name in enumerate(names) if SECTION.match(name)]
    across = _across([names[k] for k in sections], numbers, who)
    z = data[:, sections] + _line_heights(names, data, numbers, step)[:, None]
    if (bank := _channel(names, data, "banking", numbers.get("REFERENCE_LINE_START_B"))) is not None:
        z = z + bank[:, None] * (across[0] + across[1] * np.arange(len(sections)))
    line = _line(names, data, numbers, step)
    if line is None:
        return RoadGrid(z, (first, step), across)
    _refuse_crossing(line, step, across, len(sections), who)
    return RoadGrid(z, (first, step), across, line)


def _section(header: str, name: str) -> str:
    found = re.search(rf"^\${name}[^\n]*\n(.*?)^\$", header + "\n$", re.MULTILINE | re.DOTALL | re.IGNORECASE)
    return "\n".join(x for x in (found[1] if found else "").splitlines() if not x.lstrip().startswith(("*", "!")))


def _data(raw: bytes, kind: str, width: int, who: str) -> np.ndarray:
    """Numbers of all channels, (n, width); nan where they are missing."""
    if kind:
        size = width * int(kind[-1])
        return np.frombuffer(raw[: len(raw) // size * size], kind).reshape(-1, width).astype(float)
    cells: list[float] = []
    rows = -(-width // CELLS)
    lines = [x for x in raw.decode("latin-1").splitlines() if x.strip()]
    if len(lines) % rows:
        raise ModelError(f"{who}: {len(lines)} lines of data, and {width} channels take {rows} lines for each place")
    for k, line in enumerate(lines):
        count = min(CELLS, width - k % rows * CELLS)
        for i in range(count):
            text = line[CELL * i : CELL * (i + 1)].strip()
            try:
                cells.append(float("nan") if text.startswith("*") or not text else float(text))
            except ValueError:
                raise ModelError(f"{who}: {text!r} in line {k + 1} of its data is no number") from None
    return np.array(cells).reshape(-1, width)


def _channel(names: list[str], data: np.ndarray, what: str, constant: float | None) -> np.ndarray | None:
    """A channel of the reference line, its first number as the second one if it is missing; or a constant."""
    for k, name in enumerate(names):
        if name.lower().startswith(f"reference line {what}"):
            x = data[:, k].copy()
            x[0] = x[1] if np.isnan(x[0]) else x[0]
            return x
    return None if constant is None else np.full(len(data), constant)


def _line_heights(names: list[str], data: np.ndarray, numbers: dict[str, float], step: float) -> np.ndarray:
    """Heights of the reference line: its start, and the integral of its slope."""
    slope = _channel(names, data, "slope", numbers.get("REFERENCE_LINE_START_S"))
    rise = 0.0 if slope is None else np.concatenate([[0.0], np.cumsum(slope[1:]) * step])
    return np.zeros(len(data)) + numbers.get("REFERENCE_LINE_START_Z", 0.0) + rise


def _line(names: list[str], data: np.ndarray, numbers: dict[str, float], step: float) -> np.ndarray | None:
    """Points of a curved or displaced reference line; None for the x axis."""
    start = numbers.get("REFERENCE_LINE_START_X", 0.0), numbers.get("REFERENCE_LINE_START_Y", 0.0)
    heading = numbers.get("REFERENCE_LINE_START_PHI", 0.0)
    phi = _channel(names, data, "phi", None)
    if phi is None and not any((*start, heading)):
        return None
    angle = np.full(len(data), heading) if phi is None else phi
    moves = step * np.stack([np.cos(angle[1:]), np.sin(angle[1:])], axis=1)
    return np.concatenate([[start], np.array(start) + np.cumsum(moves, axis=0)])


def _across(names: list[str], numbers: dict[str, float], who: str) -> tuple[float, float]:
    """First distance to the left of the line, and spacing, of the long sections."""
    told = [m[1] for m in map(SECTION.match, names) if m is not None]
    if len(told) < 2:
        raise ModelError(f"{who}: it has {len(told)} long sections; it needs two at least")
    if all(x is not None for x in told):
        v = np.array(told, float)
        width = np.diff(v)
        if not np.allclose(width, width[0], rtol=1e-6) or width[0] <= 0.0:
            raise ModelError(
                f"{who}: its long sections are not evenly spaced; only files of a regular grid are read. Resample it"
            )
        return float(v[0]), float(width[0])
    step = numbers.get("LONG_SECTION_V_INCREMENT", 0.0)
    right = numbers.get("LONG_SECTION_V_RIGHT", -0.5 * step * (len(told) - 1))
    if not step and "LONG_SECTION_V_LEFT" in numbers:
        step = (numbers["LONG_SECTION_V_LEFT"] - right) / (len(told) - 1)
    if not step > 0.0:
        raise ModelError(f"{who}: its header gives no LONG_SECTION_V_INCREMENT, so the width is unknown")
    return right, step


def _refuse_crossing(line: np.ndarray, step: float, across: tuple[float, float], count: int, who: str) -> None:
    """Refuse a road that meets itself: a place would have two heights."""
    from scipy.spatial import cKDTree

    ends = abs(across[0]), abs(across[0] + across[1] * (count - 1))
    turned = np.diff(np.unwrap(np.arctan2(*np.diff(line, axis=0).T[::-1])))
    if len(turned) and max(ends) * np.abs(turned).max(initial=0.0) >= step:
        raise ModelError(
            f"{who}: its line is curved more tightly than the road is wide, so that it folds; make it narrower"
        )
    some = max(1, int(0.5 * sum(ends) / step))
    few = line[::some]
    for i, j in cKDTree(few).query_pairs(max(sum(ends) - some * step, 0.5 * some * step)):
        if abs(i - j) * some * step > np.pi * max(ends) + 2.0 * some * step:
            raise ModelError(
                f"{who}: it crosses itself at x = {few[i][0]:.4g} m, y = {few[i][1]:.4g} m, where it would have two "
                f"heights; cut it into roads that do not"
            )
