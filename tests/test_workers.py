"""Work in several processes: none outlives its parent, Ctrl-C is quiet, one that is lost is told of."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

SCRIPT = """
import os, signal, sys, time
from pathlib import Path
from softhand.studies.workers import WorkerLost, in_workers

def work(folder, lasts):
    (Path(folder) / str(os.getpid())).touch()
    time.sleep(lasts)
    return os.getpid()

if __name__ == "__main__":
    folder, lasts = sys.argv[1], float(sys.argv[2])
    try:
        for pid in in_workers(2, work, [(folder, 0.0), (folder, lasts), (folder, lasts)]):
            print("did", pid, flush=True)
    except KeyboardInterrupt:
        print("interrupted")
    except WorkerLost as lost:
        print("lost:", lost)
"""


class Work:
    """A program with two workers, and a way to wait for what becomes of it."""

    def __init__(self, folder: Path, lasts: float = 60.0) -> None:
        (folder / "script.py").write_text(SCRIPT)
        self._pids = folder / "pids"
        self._pids.mkdir()
        command = [sys.executable, str(folder / "script.py"), str(self._pids), str(lasts)]
        self.parent = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                       start_new_session=True, preexec_fn=_heed_ctrl_c)  # fmt: skip

    def workers(self, count: int = 2) -> list[int]:
        """Their processes, once so many have begun."""
        assert within(300.0, lambda: len(list(self._pids.iterdir())) >= count)
        return [int(file.name) for file in self._pids.iterdir()]

    def end(self) -> tuple[str, str]:
        """What it printed, and of errors."""
        return self.parent.communicate(timeout=300.0)


def _heed_ctrl_c() -> None:
    """Which what runs in the background may ignore."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def within(seconds: float, is_so: Callable[[], bool]) -> bool:
    end = time.monotonic() + seconds
    while not is_so():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False).stdout
    return bool(state) and not state.startswith("Z")


@pytest.fixture
def work(tmp_path: Path) -> Iterator[Work]:
    one = Work(tmp_path)
    yield one
    for pid in [one.parent.pid, *one.workers(0)]:
        if runs(pid):
            os.kill(pid, signal.SIGKILL)
    one.parent.wait()


def test_workers_end_with_a_parent_that_is_killed(work: Work) -> None:
    """In seconds, in the middle of their work, without a word to tell them."""
    workers = work.workers()
    work.parent.kill()
    assert within(20.0, lambda: not any(map(runs, workers)))


@pytest.mark.parametrize("times", [1, 3])
def test_ctrl_c_ends_all_at_once_and_quietly(work: Work, times: int) -> None:
    """The terminal sends it to all processes; also more than once."""
    workers = work.workers()
    for _ in range(times):
        os.killpg(work.parent.pid, signal.SIGINT)
        time.sleep(0.05)
    out, errors = work.end()
    if times == 1:  # another one in the middle of its end is for the program itself
        assert "Traceback" not in errors and out.endswith("interrupted\n")
    assert within(20.0, lambda: not any(map(runs, workers)))


def test_a_worker_that_is_killed_is_told_of(work: Work) -> None:
    """As the system does it when memory runs out; what was done before has been given."""
    assert work.parent.stdout is not None and work.parent.stdout.readline().startswith("did")
    os.kill(work.workers()[0], signal.SIGKILL)
    out, errors = work.end()
    assert "lost: A process of the work was ended from outside" in out and "Traceback" not in errors


def test_all_results_come_in_order(tmp_path: Path) -> None:
    """And the program ends by itself, with nothing on the side of errors."""
    out, errors = Work(tmp_path, 0.1).end()
    assert out.count("did") == 3 and errors == ""
