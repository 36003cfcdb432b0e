"""Machine code on disk: read only where it is one's own and whole, made anew where it is not, never in the way."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from softhand.numerics import kept, linking
from softhand.numerics.compiled import compiled

MODULE = """
import warnings
from softhand.numerics.compiled import compiled, kernels_of
from softhand.numerics.kept import KeptCodeWarning

@compiled
def once(x):
    return 1.0 * x

@compiled
def twice(x):
    return 2.0 * once(x)

with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    print(twice(1.5), len(twice.stats.cache_hits), kernels_of("small"))
print(*[str(w.message) for w in said if w.category is KeptCodeWarning], sep="|")
"""


class Small:
    """A module with one kernel, run in processes of its own with a cache of its own."""

    def __init__(self, tmp_path: Path) -> None:
        self.cache, self.file = tmp_path / "cache", tmp_path / "small.py"
        self.file.write_text(MODULE)

    def run(self, largest_file: int | None = None, **environment: str) -> tuple[list[str], str]:
        """Answer, hits and folder; then the warnings."""
        own = environment or {"SOFTHAND_CACHE_DIR": str(self.cache)}
        limit = None if largest_file is None else lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file,) * 2)
        done = subprocess.run([sys.executable, str(self.file)], capture_output=True, text=True, timeout=120,
                              env={**os.environ, **own}, preexec_fn=limit)  # fmt: skip
        assert done.returncode == 0, done.stderr
        first, said = done.stdout.splitlines()[:2] if done.stdout.count("\n") > 1 else (done.stdout, "")
        return first.split(), said

    def code(self) -> list[Path]:
        return sorted(self.cache.rglob("twice*.nbc"))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Small:
    """Run once, so that its code is kept."""
    found = Small(tmp_path_factory.mktemp("small"))
    (answer, hits, folder), said = found.run()
    assert (answer, hits, said) == ("3.0", "0", "") and folder.startswith(str(found.cache))
    shutil.copytree(found.cache, found.cache.with_name("whole"))
    shutil.copy2(found.file, found.file.with_name("whole.py"))
    return found


@pytest.fixture
def small(made: Small) -> Small:
    """As `made` was left, whatever a test before did to it."""
    shutil.rmtree(made.cache)
    shutil.copytree(made.cache.with_name("whole"), made.cache)
    shutil.copy2(made.file.with_name("whole.py"), made.file)
    return made


def _turn_a_bit(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 4]) + content[middle + 1 :]


def test_what_is_kept_is_used(small: Small) -> None:
    """The second process loads the code, and its folder is closed to others."""
    (answer, hits, _), said = small.run()
    assert (answer, hits, said) == ("3.0", "1", "")
    assert {path.stat().st_mode & 0o777 for path in small.cache.glob("*")} == {0o700}


@pytest.mark.slow
def test_kernels_are_the_same_without_parts(small: Small) -> None:
    """Where numba's inner works have changed, plain functions of numba do the same."""
    plain = {"SOFTHAND_CACHE_DIR": str(small.cache / "plain"), "SOFTHAND_LINKED": "0"}
    assert [small.run(**plain)[0][:2] for _ in range(2)] == [["3.0", "0"], ["3.0", "1"]]


def test_another_numba_is_taken_as_it_is(monkeypatch) -> None:
    """A kernel that cannot be made a part is called as one of its own."""
    monkeypatch.setattr(linking, "_Part", None)
    once = compiled(lambda x: 1.5 * x)
    twice = compiled(lambda x: 2.0 * once(x))
    assert twice(1.5) == 4.5 and len(once.signatures) == 1


def test_code_that_came_with_the_package_is_read_first(tmp_path: Path, monkeypatch) -> None:
    """Under its own key only, so that another processor's or version's is never run; damaged, it is passed over."""
    monkeypatch.setattr(kept, "SHIPPED", tmp_path / "shipped")
    shipped, own = (kept.File(tmp_path / place / "kernels-0", "twice") for place in ("shipped", "own"))
    for place, file in (("shipped", shipped), ("own", own)):
        (tmp_path / place / "kernels-0").mkdir(parents=True)
        file.save("this processor", f"code {place}")
    assert own.load("this processor") == "code shipped" and own.load("another processor") is None
    (file,) = (tmp_path / "shipped").rglob("*.nbc")
    file.write_bytes(_turn_a_bit(file.read_bytes()))
    with pytest.warns(kept.KeptCodeWarning, match="damaged"):
        assert own.load("this processor") == "code own"


DAMAGES = {
    "empty": lambda content: b"",
    "cut": lambda content: content[: len(content) // 2],
    "garbled": lambda content: os.urandom(len(content)),
    "one bit": _turn_a_bit,
}


@pytest.mark.parametrize(
    "damage",
    [pytest.param(DAMAGES[name], id=name, marks=[] if name == "one bit" else [pytest.mark.slow]) for name in DAMAGES],
)
def test_damaged_code_is_made_anew(small: Small, damage) -> None:
    """The answer is right, one warning says so, and the next start finds whole code again."""
    for file in small.code():
        file.write_bytes(damage(file.read_bytes()))
    (answer, hits, _), said = small.run()
    assert (answer, hits) == ("3.0", "0") and said.count("was damaged") == 1 and not said.count("|")
    (answer, hits, _), said = small.run()
    assert (answer, hits, said) == ("3.0", "1", "")


def test_code_of_another_function_is_not_taken(small: Small) -> None:
    """A whole file under the name of another one is no answer."""
    (file,) = small.code()
    other = file.read_bytes()
    small.file.write_text(MODULE.replace("2.0 * once", "4.0 * once"))
    (answer, _, _), _ = small.run()
    assert answer == "6.0"
    for one in small.code():
        one.write_bytes(other)
    (answer, hits, _), _ = small.run()
    assert (answer, hits) == ("6.0", "0")


def _give_away(file: Path) -> None:
    os.chown(file, 12345, 12345)


def _open_to_others(file: Path) -> None:
    file.chmod(0o666)


def _lead_elsewhere(file: Path) -> None:
    file.rename(file.with_name("elsewhere"))
    file.symlink_to("elsewhere")


def _make_a_pipe(file: Path) -> None:
    file.unlink()
    os.mkfifo(file)


@pytest.mark.parametrize(
    "spoil",
    [
        pytest.param(_give_away, marks=pytest.mark.slow),
        _open_to_others,
        pytest.param(_lead_elsewhere, marks=pytest.mark.slow),
        _make_a_pipe,
    ],
)
def test_code_that_others_may_have_written_is_not_run(small: Small, spoil) -> None:
    """Whole as it is: nothing of it is unpickled, and a pipe holds nobody up."""
    if spoil is _give_away and os.geteuid() != 0:
        pytest.skip("only root can give a file to somebody else")
    (file,) = small.code()
    spoil(file)
    (answer, hits, _), said = small.run()
    assert (answer, hits) == ("3.0", "0") and "not yours" in said
    assert small.run()[0][1] == "1"


def test_a_full_disk_is_no_obstacle(tmp_path: Path) -> None:
    """The code stays in memory; one warning, nothing half written, and the next start with room keeps it."""
    small = Small(tmp_path)
    (answer, hits, _), said = small.run(largest_file=1000)
    assert (answer, hits) == ("3.0", "0") and said.count("cannot be kept") == 1
    assert not [path for path in small.cache.rglob("*") if path.is_file()]
    assert small.run()[0][1] == "0" and small.run()[0][1] == "1"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder to somebody else")
def test_a_folder_of_somebody_else_is_not_read(small: Small, tmp_path: Path) -> None:
    """Where the cache folder cannot be used, what lies under the name of the temporary one is looked at first."""
    temporary = tmp_path / "tmp"
    foreign = temporary / f"softhand-{os.getuid()}"
    foreign.mkdir(parents=True)
    os.chown(foreign, 12345, 12345)
    blocked = tmp_path / "blocked"
    blocked.touch()
    environment = {"SOFTHAND_CACHE_DIR": "", "XDG_CACHE_HOME": str(blocked), "TMPDIR": str(temporary)}
    (answer, _, folder), _ = small.run(**environment)
    assert answer == "3.0" and not folder.startswith(str(foreign)) and folder.startswith(str(temporary))


def test_an_open_folder_of_one_s_own_is_closed(small: Small, tmp_path: Path) -> None:
    """One that others could write to is closed to them before it is used."""
    temporary = tmp_path / "tmp"
    mine = temporary / f"softhand-{os.getuid()}"
    mine.mkdir(parents=True)
    mine.chmod(0o777)
    blocked = tmp_path / "blocked"
    blocked.touch()
    (_, _, folder), _ = small.run(SOFTHAND_CACHE_DIR="", XDG_CACHE_HOME=str(blocked), TMPDIR=str(temporary))
    assert folder.startswith(str(mine)) and mine.stat().st_mode & 0o777 == 0o700
