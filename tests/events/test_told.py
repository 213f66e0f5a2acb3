"""What happened at instants, as a result tells it: lists, tables, moments, files."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.results.events import EventRecord, Events


@pytest.fixture(scope="module")
def run():
    """A block that slides freely: x = v t."""
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("block", mass=2.0, inertia=1.0), fb.Prismatic("A", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Initial("A.displacement", rate=3.0))
    return m.simulate(1.0, outputs=11)


def happened(run):
    """Three things, made up: a hit that halves the velocity, twice; and a note."""
    y = run.final[1]
    s = run.values.structure
    before, after = y.copy(), y.copy()
    after[s.nq : s.nq + s.nv] *= 0.5
    hit = EventRecord(0.5, "wall", "impact", ("bounced",), 6.75, {"wall": -3.0}, before, after)
    return [hit, EventRecord(0.5, "wall, floor", "impact"), EventRecord(0.75, "half way", "event", ("noted",))]


def test_nothing_happened(run):
    assert len(run.events) == 0
    assert repr(run.events) == "<no events>"
    assert run.events.to_dataframe().empty
    assert "events" not in dict(run.health.lines())
    assert "events" not in run.as_dict()
    with pytest.raises(fb.ModelError, match="nothing named 'wall' happened; nothing did"):
        run.events["wall"]


def test_a_list_that_is_read_by_number_and_by_name(run):
    e = Events(happened(run))
    assert [h.name for h in e] == ["wall", "wall, floor", "half way"]
    assert e[-1].done == ("noted",)
    assert [h.t for h in e["wall"]] == [0.5, 0.5]
    assert len(e["floor"]) == 1
    assert len(e["impact"]) == 2  # a kind
    assert len(e[1:]) == 2
    assert np.array_equal(e.t, [0.5, 0.5, 0.75])
    assert e.lost.sum() == 6.75
    assert e.counts() == {"wall": 2, "floor": 1, "half way": 1}
    with pytest.raises(
        fb.ModelError, match=r"nothing named 'wal' happened \(did you mean 'wall'\?\); known: wall, floor"
    ):
        e["wal"]


def test_tables(run):
    e = Events(happened(run))
    head, first, *_ = repr(e).splitlines()
    assert head.split() == ["t", "[s]", "name", "kind", "done", "lost", "[J]"]
    assert first.split() == ["0.5", "wall", "impact", "bounced", "6.75"]
    table = e.to_dataframe()
    assert list(table.columns) == ["t", "name", "kind", "done", "lost", "impulse wall"]
    assert table["impulse wall"][0] == -3.0
    assert "<td>half way</td>" in e._repr_html_()
    many = Events([EventRecord(0.1 * k, "tick", "event") for k in range(400)])
    assert len(repr(many).splitlines()) == 22
    assert "... 380 more before the last one" in repr(many)
    assert many.summary() == "400: tick 400 times"
    assert str(e[0]) == "t = 0.5 s, wall (impact): bounced, 6.75 J lost"


def test_before_and_after_are_read_by_name(run):
    run.events = happened(run)
    hit = run.events[0]
    assert hit.before["block.vx"] == pytest.approx(3.0, abs=1e-12)
    assert hit.after["A.rate"] == pytest.approx(1.5, abs=1e-12)
    assert hit.after["block.velocity"] == pytest.approx([1.5, 0.0], abs=1e-12)
    assert hit.before["energy.kinetic"] - hit.after["energy.kinetic"] == pytest.approx(hit.lost, abs=1e-11)
    assert run.events[2].before is None
    for name in ("block.ax", "A.fx"):
        with pytest.raises(fb.ModelError, match=f"{name!r} has no value at the instant t = 0.5 s of an event"):
            hit.before[name]
    with pytest.raises(fb.ModelError, match="did you mean 'vx'"):
        hit.before["block.vxx"]
    assert dict(run.health.lines())["events"] == "3: wall 2 times, floor, half way; 6.75 J lost"
    assert run.as_dict()["events"][0]["impulses"] == {"wall": -3.0}


def test_files_hold_them(run, tmp_path):
    run.events = happened(run)
    run.save(tmp_path / "r.nc")
    again = fb.load_result(tmp_path / "r.nc")
    assert list(again.events) == list(run.events)
    assert again.events[0].impulses == {"wall": -3.0}
    assert again.events[0].after["block.vx"] == run.events[0].after["block.vx"]
    assert again.events[2].before is None
    assert again.health.events == run.health.events
    run.events = ()
    run.save(tmp_path / "r.nc")
    assert len(fb.load_result(tmp_path / "r.nc").events) == 0
