"""A contest: one motion, one target; every engine at its coarsest setting that meets it, then all timed in turn.

A peer's resolution is a number of fixed steps (at least 1) or a tolerance (below 1). It is made finer (coarser) by
factors of 2 (10) until the target is met (missed), and the last interval is halved twice. flyball gets the loosest
tolerance on a grid of half decades, with its own error control and stabilization on.

Two times of each: the kernel, stepping alone from a state that is ready, and the whole call. flyball's whole call is
``model.simulate(t_end, rtol=...)`` as a user writes it, outputs, assembly and report included. A peer's is its loop
with the samples kept, from a model that is built.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

from flyball.numerics.integrators.butcher_tableaux import TABLEAUX
from mechanisms import Kernel, simulate

TOLERANCES = tuple(10.0 ** (-e / 2) for e in range(4, 25))
FINEST = 1e-13
HALVINGS = 2
ENOUGH = 100  # times of a motion that can be judged
TIMED = 10.0  # CPU seconds that the readings in turn may take, if that leaves three of each
FAILURES = (RuntimeError, ValueError, np.linalg.LinAlgError)
OPEN = float("inf")

NAMED = {"kernel": "cpu_ms", "call": "call_ms", "compiled": "compiled_ms"}
RATIOS = {"cpu_ms": "ratio", "call_ms": "call_ratio"}
COLUMNS = {
    "case": "case",
    "engine": "engine",
    "setting": "setting",
    "resolution": "steps or rtol",
    "steps": "steps",
    "evaluations": "evaluations",
}
TIMES = {
    "cpu_ms": "CPU ms",
    "ratio": "ratio",
    "call_ms": "whole call",
    "call_ratio": "its ratio",
    "compiled_ms": "without Python",
}


@dataclass(frozen=True)
class Contest:
    """What all have to reach.

    ``accuracy`` takes a motion, whatever that is, and returns numbers, of which ``key`` has to come to ``target``.
    Motions have ``samples`` + 1 times. A peer's search ends unmet with a run that takes longer than ``patience``
    [CPU s], or where all its runs took five times that. Times are divided by ``per`` (the seconds of the motion, for
    milliseconds a second).
    """

    case: str
    t_end: float
    accuracy: Callable[[Any], dict[str, float]]
    key: str
    target: float
    samples: int = 500  # intervals of simulate's usual outputs
    patience: float = 10.0
    per: float = 1.0


@dataclass(frozen=True)
class Peer:
    """Another engine: ``solve(resolution, samples)`` returns (motion, or None without samples; CPU s of stepping).

    ``compiled(resolution, samples)``: CPU seconds of a run in the engine's own code, where Python runs the rest.
    """

    engine: str
    setting: str
    solve: Callable[[float, int], tuple[Any, float]]
    first: float
    compiled: Callable[[float, int], float] | None = None


def peer(name: str, setting: str, model: Any, t_end: float, first: float, even: int = 1) -> Peer:
    """A peer by the name of its module, for a model that this takes; its motion is judged as it is.

    Its numbers of steps are made multiples of ``even``, which sets samples at even times.
    """
    module = import_module(f"peer_{name}")

    def solve(resolution: float, samples: int) -> tuple[Any, float]:
        if resolution >= 1:
            resolution = even * -(-resolution // even)
            samples = samples and max(k for k in range(1, samples + 1) if resolution % k == 0 and k % even == 0)
        return module.solve(model, t_end, resolution, setting, samples)

    def compiled(resolution: float, samples: int) -> float:
        return module.compiled_part(model, t_end, resolution, setting, samples)

    own = compiled if hasattr(module, "compiled_part") else None
    return Peer(name.partition("_")[0], setting, solve, first, own)


@dataclass(frozen=True)
class Flyball:
    """Our side: a model and what of its result is the motion."""

    model: Any
    motion: Callable[[Any], Any]
    method: str = "dop853"
    coordinates: str = "auto"
    loosest: float = TOLERANCES[0]
    specialize: bool | str = "auto"


class Search:
    """A peer's coarsest resolution that meets the target, or the best that was seen."""

    def __init__(self, contest: Contest, peer: Peer) -> None:
        self.contest, self.peer = contest, peer
        self.row: dict[str, Any] = {"met": False, contest.key: OPEN}
        self.seconds = self.spent = 0.0

    def meets(self, resolution: float) -> bool:
        """Try a resolution. A solver that gives up has an infinite error."""
        contest, peer = self.contest, self.peer
        begin = time.process_time()
        try:
            found = contest.accuracy(peer.solve(resolution, contest.samples)[0])
        except FAILURES:
            found = {}
        self.seconds = time.process_time() - begin
        self.spent += self.seconds
        error = found.get(contest.key, OPEN)
        met = bool(error <= contest.target)
        if met or (not self.row["met"] and error <= self.row[contest.key]):
            self.row |= found | {"resolution": resolution, "met": met}
        return met

    def finer(self, r: float) -> float:
        return 2 * r if r >= 1 else r / 10

    def coarser(self, r: float) -> float:
        return max(r // 2, 1) if r >= 1 else min(10 * r, 0.1)

    def between(self, coarse: float, fine: float) -> float:
        return (coarse + fine) // 2 if fine >= 1 else (coarse * fine) ** 0.5

    def run(self) -> dict[str, Any]:
        """Search; returns the row."""
        fine = self.peer.first
        if self.meets(fine):
            coarse = self.coarser(fine)
            while coarse != fine and self.meets(coarse):
                fine, coarse = coarse, self.coarser(coarse)
        else:
            coarse, fine = fine, self.finer(fine)
            while not self.meets(fine):
                if self.seconds > self.contest.patience or self.spent > 5 * self.contest.patience or fine < FINEST:
                    return self.row
                coarse, fine = fine, self.finer(fine)
        for _ in range(HALVINGS):
            middle = self.between(coarse, fine)
            if self.meets(middle):
                fine = middle
            else:
                coarse = middle
        return self.row


def find_peer(contest: Contest, peer: Peer) -> dict[str, Any]:
    """A peer's row with its clock."""
    row = {"engine": peer.engine, "setting": peer.setting} | Search(contest, peer).run()
    best = row.get("resolution", 0)
    row["steps"] = int(best) if best >= 1 else None
    row["clocks"] = {"kernel": lambda: peer.solve(best, 0)[1], "call": lambda: peer.solve(best, contest.samples)[1]}
    if peer.compiled is not None:
        row["clocks"]["compiled"] = lambda: peer.compiled(best, contest.samples)
    return row


def find_flyball(contest: Contest, ours: Flyball) -> dict[str, Any]:
    """The loosest tolerance of the grid that meets the target, with default stabilization."""
    from flyball import FlyballError

    setting = ours.method + {True: ", made code", False: ", tables"}.get(ours.specialize, "")
    row: dict[str, Any] = {"engine": "flyball", "setting": setting, "met": False, contest.key: OPEN, "failed": []}
    for rtol in (r for r in TOLERANCES if r <= ours.loosest):
        options = {"rtol": rtol, "method": ours.method, "coordinates": ours.coordinates, "specialize": ours.specialize}
        outputs = contest.samples + 1
        try:
            run = simulate(ours.model, contest.t_end, outputs=outputs, **options)
        except FlyballError as error:
            row["failed"].append(f"rtol {rtol:.1e}: {str(error)[:200]}")
            continue
        found = contest.accuracy(ours.motion(run))
        if not found[contest.key] <= row[contest.key]:
            continue
        row |= found | {"resolution": rtol, "steps": run.health.steps + run.health.rejected}
        row |= {"evaluations": run.health.evaluations, "factorisations": run.health.factorisations}
        row["clocks"] = clocks(ours.model, contest.t_end, outputs, options)
        if found[contest.key] <= contest.target:
            row["met"] = True
            break
    return row


def clocks(model: Any, t_end: float, outputs: int, options: Mapping[str, Any]) -> dict[str, Callable[[], float]]:
    """What is timed of flyball: the compiled loop, if it is an explicit one, and the whole call."""
    out = {"call": lambda: timing.cpu(lambda: simulate(model, t_end, outputs=outputs, **options))}
    if options["method"] in TABLEAUX and options["specialize"] is not True:
        kept = {k: x for k, x in options.items() if k != "specialize"}
        out["kernel"] = Kernel(model, t_end, 2, **kept).seconds
    return out


def run(contest: Contest, ours: Sequence[Flyball], peers: Sequence[Peer]) -> list[dict[str, Any]]:
    """All engines: searched one after the other, then timed in turn."""
    print(timing.heading(), flush=True)
    rows = []
    for searched, entries in ((find_flyball, ours), (find_peer, peers)):
        for entry in entries:
            row = {"case": contest.case} | searched(contest, entry)
            text = f"{row.get('resolution')}: {row[contest.key]:.3g}{'' if row['met'] else ', not met'}"
            print(f"  {contest.case}, {row['engine']}, {row['setting']}: {text}", flush=True)
            rows.append(row)
    time_in_turn(contest, [row for row in rows if row["met"]])
    for row in rows:
        row.pop("clocks", None)
        if not row["met"]:
            row["resolution"] = f"not met ({timing.text(row.get('resolution'))})"
    return rows


def time_in_turn(contest: Contest, rows: Sequence[dict[str, Any]]) -> None:
    """Put the times into the rows."""
    all_clocks = {(i, key): clock for i, row in enumerate(rows) for key, clock in row["clocks"].items()}
    first = timing.interleaved(all_clocks, 1)
    repeats = int(np.clip(TIMED / max(sum(first.values()), 1e-6), 3 if sum(first.values()) < TIMED else 1, 25))
    seconds = timing.interleaved(all_clocks, repeats)
    for i, row in enumerate(rows):
        row |= {NAMED[key]: 1e3 * seconds[i, key] / contest.per for key in row["clocks"]}
    for key, ratio in RATIOS.items():
        ours = min((row[key] for row in rows if row["engine"] == "flyball" and key in row), default=None)
        for row in rows:
            row[ratio] = row[key] / ours if ours and key in row else None


def ratios(rows: Sequence[Mapping[str, Any]]) -> str:
    """Best peer over flyball's best, for the kernel and for the whole call."""
    peers = [r for r in rows if r["engine"] != "flyball" and r["met"]]
    ours = [r for r in rows if r["engine"] == "flyball" and r["met"]]
    if not peers or not ours:
        return f"{rows[0]['case']}: no ratio, the target was not met by both sides"
    texts = []
    for key, label in (("cpu_ms", "kernel"), ("call_ms", "whole call")):
        if not any(key in r for r in ours):
            continue
        peer, best = min(peers, key=lambda r: r[key]), min(r[key] for r in ours if key in r)
        told = f"{peer['engine']} ({peer['setting']}) {peer[key]:.3g} ms"
        texts.append(f"{label}: flyball {best:.3g} ms, best peer {told}, ratio {peer[key] / best:.2f}")
    return f"{rows[0]['case']}: " + "; ".join(texts)


def show(rows: Sequence[Mapping[str, Any]], accuracy: Mapping[str, str], unit: str = "CPU ms") -> str:
    """The table of one contest, with the columns of its accuracy, and the ratios."""
    failures = [f"  flyball, {row['setting']}, failed at {text}" for row in rows for text in row.get("failed", [])]
    columns = COLUMNS | dict(accuracy) | TIMES | {"cpu_ms": unit}
    return "\n".join([timing.table(rows, columns), ratios(rows), *failures])


def parser(text: str) -> argparse.ArgumentParser:
    """Options that all of these scripts have."""
    made = argparse.ArgumentParser(description=text.splitlines()[0])
    made.add_argument("--coordinates", choices=("auto", "absolute", "joint"), default="auto", help="flyball's (auto)")
    made.add_argument("--json", metavar="FILE", help="write the rows")
    return made
