"""Studies in files: read back to the bit, gone on with where they were interrupted, refused where they are others."""

from __future__ import annotations

import json
from concurrent.futures import Executor, Future, ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr

import flyball as fb
from flyball.studies import study as module
from tests.study.rigs import oscillator

VARY = {"k": np.linspace(50.0, 150.0, 200)}
OF = ["end(b.x)", "b.vx"]


def ask(file=None, m=None, **more):
    return (m or oscillator()).study(VARY, OF, **{"t_end": 0.1, "outputs": 3, "file": file} | more)


def test_a_file_is_the_study(tmp_path):
    m = oscillator()
    m.parameters["mass"] = "2 kg"
    s = m.study(
        {"k": [100.0, -1e300, 50.0], "c": [0, 0.1]}, OF, t_end=0.1, outputs=3, parameters={"x0": 0.2}, rtol=1e-6
    )
    s.save(tmp_path / "s.nc")
    back = fb.load_study(tmp_path / "s.nc")
    assert json.dumps(back.as_dict()) == json.dumps(s.as_dict())
    for name in OF:
        assert back[name].tobytes() == s[name].tobytes()
    assert back.lines() == s.lines()
    assert m.simulate(**back.question(1))["b.x"][-1] == s["end(b.x)"][0, 1]
    with xr.open_dataset(tmp_path / "s.nc", engine="h5netcdf") as data:  # as other programs read it
        assert data["end(b.x)"].dims == ("run",)
        assert data["b.vx"].attrs["units"] == "m/s"


def test_an_interrupted_study_goes_on(tmp_path):
    whole = ask()
    file = tmp_path / "s.nc"

    def interrupt(done: float) -> None:
        if done > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(fb.Interrupted) as ended:
        ask(file, progress=interrupt)
    part = ended.value.result
    n = int(part.done.sum())
    assert 0.4 * 200 < n < 200
    assert not part.complete
    assert "interrupted by the user" in part.message
    assert fb.load_study(file).done.sum() == n
    seen: list[float] = []
    rest = ask(file, progress=seen.append)
    assert seen[0] > 0.4  # what was done is not done again
    assert rest.complete
    assert rest.message == ""
    for name in OF:
        assert rest[name].tobytes() == whole[name].tobytes()
    seen.clear()
    ask(file, progress=seen.append)
    assert seen == []


def test_a_killed_study_has_a_file_that_is_whole(tmp_path, monkeypatch):
    """It is written while it runs; a process that dies leaves the last one."""
    monkeypatch.setattr(module, "SAVE_INTERVAL", 0.0)
    file = tmp_path / "s.nc"

    class Killed(BaseException):
        pass

    def kill(done: float) -> None:
        if done > 0.5:
            raise Killed

    with pytest.raises(Killed):
        ask(file, progress=kill)
    left = fb.load_study(file)
    assert 0.0 < left.done.mean() < 0.6
    assert "ended before all runs were done" in left.message
    assert ask(file)["b.vx"].tobytes() == ask()["b.vx"].tobytes()


@pytest.mark.parametrize(
    "other",
    [{"rtol": 1e-6}, {"t_end": 0.2}, {"outputs": 4}, {"parameters": {"c": 1.0}}, {"m": "heavier"}, {"method": "rk45"}],
)
def test_a_file_of_another_study_is_refused(tmp_path, other):
    file = tmp_path / "s.nc"
    ask(file)
    if "m" in other:
        other = {"m": oscillator()}
        other["m"].parameters["mass"] = 3.0
    before = file.read_bytes()
    with pytest.raises(fb.ModelError, match="is of another study than this"):
        ask(file, **other)
    assert file.read_bytes() == before


def test_functions_that_were_changed_are_another_study(tmp_path):
    def asked(f):
        return oscillator().study({"k": [1.0]}, {"f": f}, t_end=0.1, outputs=3, file=tmp_path / "s.nc")

    asked(lambda r: r["b.x"][-1])
    asked(lambda r: r["b.x"][-1])
    with pytest.raises(fb.ModelError, match="another study"):
        asked(lambda r: 2.0 * r["b.x"][-1])


def test_files_that_are_no_study(tmp_path):
    with pytest.raises(fb.ModelError, match="there is no file"):
        fb.load_study(tmp_path / "none.nc")
    oscillator().simulate(0.1, outputs=3).save(tmp_path / "r.nc")
    with pytest.raises(fb.ModelError, match="is a result, no study"):
        fb.load_study(tmp_path / "r.nc")
    ask(tmp_path / "s.nc")
    data = bytearray((tmp_path / "s.nc").read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "s.nc").write_bytes(data)
    with pytest.raises(fb.ModelError, match="is damaged"):
        fb.load_study(tmp_path / "s.nc")
    with pytest.raises(fb.ModelError, match="is damaged"):
        ask(tmp_path / "s.nc")


def test_any_executor():
    with ThreadPoolExecutor(2) as pool:
        assert ask(executor=pool)["b.vx"].tobytes() == ask()["b.vx"].tobytes()


def test_an_executor_that_fails_leaves_what_was_done(tmp_path):
    class Fails(Executor):
        left = 10

        def submit(self, function, /, *args, **words):
            out: Future = Future()
            self.left -= 1
            if self.left < 0:
                out.set_exception(OSError("the machine is gone"))
            else:
                out.set_result(function(*args, **words))
            return out

    file = tmp_path / "s.nc"
    with pytest.raises(fb.AnalysisError, match=r"OSError: the machine is gone\); the completed runs are in .*s.nc"):
        ask(file, executor=Fails())
    assert 0 < fb.load_study(file).done.sum() < 200
    assert ask(file)["b.vx"].tobytes() == ask()["b.vx"].tobytes()
