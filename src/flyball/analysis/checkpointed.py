"""A motion that is kept in a file as it goes on, part by part, and goes on from there: see `Mechanism.simulate`.

A part begins where the one before it ended, by what a result says and nothing else: what a result does not hold, such
as factors and what solvers begin with, each part finds anew. So a motion that was interrupted, or
killed, and goes on from its file is to the last digit the one that was not.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FlyballError, Interrupted, ModelError, SimulationError
from ..model.model import Model
from ..results.result import Result
from ..results.study_reading import fingerprint
from .checkpoints.heeded import heeded
from .checkpoints.keeper import Keeper
from .motion.choice import AUTO as ANY
from .motion.choice import SimulateOptions, Way, chosen, instead_of, unresolved
from .motion.impulse.ending import INTERRUPTED
from .motion.options import output_times
from .motion.part import Part
from .motion.start import start_time
from .progress import Tell, shown
from .simulate import Span, simulate, told


@dataclass(frozen=True, kw_only=True)
class CheckpointOptions(SimulateOptions):
    """What `Mechanism.simulate` is asked."""

    checkpoint: str | os.PathLike | None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.checkpoint is not None and not isinstance(self.checkpoint, (str, os.PathLike)):
            raise ModelError(f"checkpoint is the path of a file, not {self.checkpoint!r}")


def checkpointed(model: Model, o: CheckpointOptions) -> Result:
    """The motion; kept in a file on the way if that is asked for."""
    return simulate(model, o) if o.checkpoint is None else _kept(model, o)


def _kept(model: Model, o: CheckpointOptions) -> Result:
    assert o.checkpoint is not None
    cls, model = type(model), model.snapshot()
    t_start = start_time(o.t_start, o.start)
    span = (t_start, o.t_end, output_times(t_start, o.t_end, o.outputs))
    way = chosen(model, o)
    kept = Keeper(Path(o.checkpoint), _mark(model, o, span), span[2])
    if not kept.path.absolute().parent.is_dir():
        raise ModelError(f"checkpoint={os.fspath(o.checkpoint)!r}: there is no such folder")
    if kept.read(cls):
        return kept.parts[-1]
    with shown(o.progress, "simulating") as tell:
        return _Motion(model, way, span, kept, tell, o.method == ANY).all()


def _mark(model: Model, o: CheckpointOptions, span: Span) -> str:
    known = {f.name: getattr(o, f.name) for f in fields(SimulateOptions)}
    try:
        return fingerprint(model, np.array(span[:2]), known, (), span[2])
    except ModelError as error:
        raise ModelError(f"checkpoint: the motion cannot be kept in a file: {error}") from None


class _Motion:
    """Part after part."""

    def __init__(self, model: Model, way: Way, span: Span, kept: Keeper, tell: Tell, auto: bool) -> None:
        self.model, self.way, self.span, self.kept, self.tell = model, way, span, kept, tell
        self.auto = auto

    def all(self) -> Result:
        """To the end."""
        kept, way = self.kept, self.way
        options, why = (way.instead, kept.by) if kept.by and way.instead is not None else (way.options, way.why)
        try:
            return self._through(options, why)
        except (ModelError, SimulationError) as error:
            if way.instead is None or options is way.instead or not unresolved(error):
                raise
            kept.anew(instead_of(error))
            try:
                return self._through(way.instead, kept.by)
            except FlyballError:
                raise error from None

    def _through(self, o: SimulateOptions, why: str) -> Result:
        """To the end, by a method that is chosen."""
        kept = self.kept
        while True:
            try:
                found, part = self._part(o, why)
            except SimulationError as error:
                kept.write()
                if isinstance(error.result, Result):
                    error.result = kept.whole(error.result)
                raise
            except Interrupted as error:
                raise self._left(kept.whole(error.result)) from None
            if not part.paused:
                break
            kept.add(found)
            if part.asked:
                result = kept.whole()
                result.health.message = INTERRUPTED.format(result.final[0])
                raise self._left(result)
        result = kept.whole(found)
        kept.finish(result)
        return result

    def _left(self, result: Result) -> Interrupted:
        """What is raised for the user's interrupt: what goes on does so from where the last part ended."""
        kept = self.kept
        kept.write()
        result.health.message += (
            f"; {kept.path} holds it to t = {kept.parts[-1].final[0]:.6g} s, from where the same call goes on"
            if kept.parts
            else f"; no part of it had ended yet, so nothing is in {kept.path}: the same call begins anew"
        )
        return Interrupted(result.health.message, result)

    def _part(self, o: SimulateOptions, why: str) -> tuple[Result, Part]:
        """The next part: its motion, and how it ended."""
        first, last, times = self.span
        before = self.kept.parts[-1] if self.kept.parts else None
        t = first if before is None else before.final[0]
        part = Part(first, later=before is not None)

        def tell(fraction: float) -> None:
            try:
                self.tell((t + fraction * (last - t) - first) / (last - first))
            except KeyboardInterrupt:
                if not part.interrupted():
                    raise

        changed: Mapping[str, Any] = {"progress": tell}
        if before is not None:
            changed = {**changed, "start": before, "t_start": None}
            times = times[times >= t] if before.carried.get("open") else times[times > t]
        with heeded(part):
            return told(self.model, o.known(**changed), (t, last, times), why, self.auto, part), part
