"""A run of a study is doubtful where the single run is, with the same reasons, however it was computed and read."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr

import flyball as fb

ROUGH = {"t_end": 10, "method": "rk45", "rtol": 0.1}
OF = {
    "an end": ["end(a.y)"],
    "a number": ["max(a.y)"],
    "a curve": ["a.y"],
    "a function": {"y": lambda r: r["a.y"][-1]},
    "a force": ["A.fx"],
}


def pendulum(**more):
    """It turns over with a spring of ``k`` and ``J`` about its pin; a part that nothing connects with it lies still."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -9.81), parameters={"J": 1 / 12, "k": 1.0})
    m.add(fb.Body("a", mass=1, inertia="J", position=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("S", "A", stiffness="k", damping="0.01*k"))
    m.add(fb.Body("other", mass=1, inertia=1), fb.Prismatic("W", "ground", "other", at=(3, 0), axis=(1, 0)))
    return m


def single(m, s):
    """What single runs say."""
    found = {k: m.simulate(**s.question(k)).health.doubtful for k in range(len(s))}
    return {k: "; ".join(texts) for k, texts in found.items() if texts}


@pytest.mark.parametrize("of", OF)
@pytest.mark.parametrize("name", ["k", "J"])
def test_a_study_doubts_what_single_runs_doubt(name, of):
    """Forces alone, or masses too: runs that share their tables, and those of a function, which do not."""
    m = pendulum()
    s = m.study({name: np.linspace(0.5, 2.0, 6)}, OF[of], **ROUGH)
    told = single(m, s)
    assert len(told) > 0
    assert s.doubtful == told
    assert s.done.all()
    for k, text in told.items():
        assert text in s.remarks[k]
        assert s.words[k] == "done, but doubtful"
    assert (s.words == "done").sum() == 6 - len(told)
    assert f"6 done ({len(told)} of them doubtful)" in str(s)
    assert not m.study({name: np.linspace(0.5, 2.0, 6)}, OF[of], t_end=10).doubtful


def test_steps_of_a_fixed_width():
    m = pendulum()
    s = m.study({"k": [1.0, 1.5]}, ["end(a.y)"], **(ROUGH | {"method": "generalised-alpha", "step": 0.2}))
    assert s.doubtful == single(m, s)
    assert s.doubtful


def test_files_and_labelled_data_have_the_mark(tmp_path):
    m, file = pendulum(), tmp_path / "s.nc"
    with ThreadPoolExecutor(1) as pool:
        s = m.study({"k": [1.0, 1.5], "J": [0.1, 0.2]}, ["end(a.y)"], file=file, executor=pool, **ROUGH)
    marked = np.isin(np.arange(4), list(s.doubtful)).astype(int)
    assert marked.any()
    assert s.to_xarray()["doubtful"].dims == ("k", "J")
    assert s.to_xarray()["doubtful"].values.ravel().tolist() == marked.tolist()
    assert s.to_dataframe().attrs["doubtful"] == sorted(s.doubtful)
    with xr.open_dataset(file, engine="h5netcdf") as data:
        assert data["doubtful"].values.tolist() == marked.tolist()
    assert fb.load_study(file).doubtful == s.doubtful
    assert json.loads(json.dumps(s.as_dict()))["doubtful"] == {str(k): x for k, x in s.doubtful.items()}
