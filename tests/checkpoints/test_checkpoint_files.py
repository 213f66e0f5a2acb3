"""Files of checkpoints: how much is written, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.results.result import concatenate_results
from flyball.simulation import checkpoints as keeper

from .motions import Killed, cut, double_pendulum, killed


def test_all_that_is_written_is_a_few_times_the_result(tmp_path, monkeypatch):
    """Some sixty parts: to write all each time would be thirty times as much."""
    sizes, most = [], [0]
    save = keeper.save

    def counted(result, path, *, with_labelled):
        save(result, path, with_labelled=with_labelled)
        sizes.append(len(result.t) if not with_labelled else 0)
        most[0] = max(most[0], len(list(tmp_path.iterdir())))

    monkeypatch.setattr(keeper, "save", counted)
    cut(monkeypatch, 10)
    run = double_pendulum().simulate(12, rtol=1e-9, outputs=2001, checkpoint=tmp_path / "run.nc")
    assert len(sizes) > 30
    assert sum(sizes) < 4 * len(run.t)
    assert most[0] <= keeper.MOST_FILES + 1


def test_files_of_an_earlier_motion_are_not_taken_for_this_one(tmp_path, monkeypatch):
    m, path, how = double_pendulum(), tmp_path / "run.nc", {"t_end": 4, "outputs": 401}
    cut(monkeypatch, 10)
    monkeypatch.setattr(keeper.CheckpointFile, "finish", lambda *a: (_ for _ in ()).throw(Killed))
    with pytest.raises(Killed):
        m.simulate(checkpoint=path, **how)
    beside = sorted(p for p in tmp_path.iterdir() if p != path)
    assert beside
    monkeypatch.undo()
    path.unlink()  # the others stay
    cut(monkeypatch, 10)
    run = killed(m, path, monkeypatch, (1, 1, 2), **how)
    assert np.array_equal(run.t, np.linspace(0, 4, 401))
    assert sorted(tmp_path.iterdir()) == [path]


def test_parts_end_to_end_are_the_whole():
    m = double_pendulum()
    t = np.linspace(0, 2, 21)
    first = m.simulate(1, outputs=t[:11])
    second = m.simulate(2, outputs=t[11:], start=first)
    both = concatenate_results([first, second], t)
    assert np.array_equal(both.t, t)
    assert both.health.steps == first.health.steps + second.health.steps
    balance = both.energy.total - sum(both.energy.work.values())
    assert balance == pytest.approx(balance[0], abs=1e-5)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda m, p: m.simulate(3, checkpoint=p), "is of another motion than this"),
        (lambda m, p: m.simulate(2, checkpoint=p, rtol=1e-8), "is of another motion than this"),
        (lambda m, p: m.changed({"M": None}).simulate(2, checkpoint=p), "is of another motion than this"),
        (lambda m, p: m.simulate(2, checkpoint=p.parent / "no" / "run.nc"), "there is no such folder"),
        (lambda m, p: m.simulate(2, checkpoint=3), "checkpoint is the path of a file, not 3"),
        (lambda m, p: (m.simulate(1).save(p), m.simulate(2, checkpoint=p)), "not one that was kept with checkpoint="),
        (lambda m, p: (p.write_text("x"), m.simulate(2, checkpoint=p)), "cannot be read as a NetCDF result"),
        (
            lambda m, p: (m.add(fb.Motor("N", "A", torque=lambda t: t)), m.simulate(2, checkpoint=p)),
            "the motion cannot be kept in a file",
        ),
    ],
)
def test_wrong_files_are_refused_before_anything_is_computed(change, says, tmp_path):
    m, path = double_pendulum(), Path(tmp_path) / "run.nc"
    m.simulate(2, checkpoint=path)
    with pytest.raises(fb.ModelError, match=re.escape(says)):
        change(m, path)
