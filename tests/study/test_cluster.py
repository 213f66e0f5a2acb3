"""A study on a cluster: two worker processes of Dask on this machine."""

from __future__ import annotations

import pytest

from tests.study.rigs import oscillator

distributed = pytest.importorskip("distributed", reason="the extra 'cluster' (dask, distributed) is not installed")


def test_two_worker_processes_make_what_threads_make():
    vary, of = {"k": [50.0, 100.0, -1e300, 70.0, 80.0, 90.0], "x0": [0.1, 0.2]}, {"end": lambda r: r["b.x"][-1]}
    here = oscillator().study(vary, of, t_end=0.1, outputs=3)
    names = oscillator().study(vary, ["b.vx"], t_end=0.1, outputs=3)
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    )
    with cluster, distributed.Client(cluster) as client:
        executor = client.get_executor()
        there = oscillator().study(vary, of, t_end=0.1, outputs=3, executor=executor)
        also = oscillator().study(vary, ["b.vx"], t_end=0.1, outputs=3, executor=executor)
        workers = {k.split(":")[-1] for k in client.scheduler_info()["workers"]}
    assert len(workers) == 2
    assert there["end"].tobytes() == here["end"].tobytes()
    assert there.reasons == here.reasons
    assert set(there.reasons) == {4, 5}
    assert also["b.vx"].tobytes() == names["b.vx"].tobytes()
