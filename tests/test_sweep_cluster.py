"""Sweeps on a Dask cluster: the same numbers to the last bit, whoever is killed; and stores open in xarray."""

from __future__ import annotations

import os
import signal
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_sweep import STUDY, assert_same, chunks_done, write

from softhand import sweep
from softhand.errors import StudyError
from softhand.studies.sweeps import cluster as cluster_module

_EXTRA = "needs the extra studies"


@pytest.mark.slow
def test_a_cluster_whose_worker_is_killed_loses_nothing(tmp_path: Path) -> None:
    """Two workers, of which one is killed while it has chunks."""
    distributed = pytest.importorskip("distributed", reason=_EXTRA)
    text = STUDY.replace("duration = 0.04", "duration = 0.2").replace("count = 14", "count = 60")
    file, out = write(tmp_path, text), tmp_path / "out"
    killed: list[int] = []
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:

        def progress(done: int, runs: int) -> None:
            if done >= 6 and not killed:
                killed.append(next(iter(cluster.workers.values())).pid)
                os.kill(killed[0], signal.SIGKILL)

        found = sweep(file, out, scheduler=cluster.scheduler_address, chunk=2, progress=progress)
    assert killed and len(chunks_done(out)) == 30
    assert_same(sweep(file, tmp_path / "serial", threads=1, chunk=60), found)


@pytest.mark.slow
def test_a_worker_must_see_the_store(tmp_path: Path) -> None:
    """And be of the versions that it was made with; both are told by the worker."""
    distributed = pytest.importorskip("distributed", reason=_EXTRA)
    file, out = write(tmp_path, STUDY), tmp_path / "out"
    found = sweep(file, out, chunk=7)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        client = cluster_module.connect(cluster.scheduler_address)
        gone = client.submit(cluster_module.make, str(tmp_path / "gone"), found._store.digest, 0)
        with pytest.raises(StudyError, match="a worker does not see this store"):
            gone.result()
        assert client.submit(cluster_module.make, str(out), found._store.digest, 1).result()["runs"] == 7
        client.close()


def test_mistakes_of_the_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody there, or no address; nothing is left behind."""
    pytest.importorskip("distributed", reason=_EXTRA)
    monkeypatch.setattr(cluster_module, "_CONNECT", 0.5)
    before = threading.active_count()
    for address in ("tcp://127.0.0.1:1", "nonsense", "tcp://127.0.0.1", "tcp://127.0.0.1:x"):
        with pytest.raises(StudyError, match="no scheduler of Dask answers there"):
            sweep(write(tmp_path), tmp_path / "out", scheduler=address)
    assert threading.active_count() <= before  # none that would keep the process alive


def test_without_dask_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And what works without."""
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(StudyError, match=r"pip install 'softhand\[studies\]'.*threads of this machine"):
        sweep(write(tmp_path), tmp_path / "out", scheduler="tcp://127.0.0.1:1")


def test_xarray_opens_the_store(tmp_path: Path) -> None:
    """All arrays, their units and what was varied; also of a store that is not done."""
    xarray: Any = pytest.importorskip("xarray")
    pytest.importorskip("zarr", reason=_EXTRA)
    text = STUDY + '[keep]\nvariables = ["contact_force"]\nevery = 0.02\n'
    found = sweep(write(tmp_path, text), tmp_path / "out", chunk=4)
    data = found.to_xarray().load()
    assert set(data.coords) >= {"run", "object.mass", "object.position[0]", "contact", "time"}
    for name, values in found.numbers.items():
        assert np.array_equal(data[name].values, values)
    assert data["error"].attrs["units"] == "mm" and data.run.values.tolist() == list(range(14))
    assert np.array_equal(data["object.mass"], found.values["object.mass"])
    assert np.array_equal(data["contact_force"], found.kept["contact_force"])
    assert data["contact_force"].dims == ("run", "time", "contact", "force_component")
    assert data.outcome.values.tolist() == found.outcome.tolist() and (data.success == found.success).all()
    for file in (tmp_path / "out").glob("runs.zarr/*/1*"):
        file.unlink()
    data = xarray.open_zarr(tmp_path / "out/runs.zarr").load()
    assert np.isnan(data["error"][4:8]).all() and np.isfinite(data["error"][:4]).all()
    assert np.isnan(data["success"][4:8]).all() and data.outcome.values[8] == "finished"
