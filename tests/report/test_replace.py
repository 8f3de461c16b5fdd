"""A kill at any moment leaves the old set of files or the new one; files that are not ours stay."""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from planner.report.replace import replacing

linux_only = pytest.mark.skipif(sys.platform != "linux", reason="directories are exchanged on Linux only")

# Writes sets of three files without end; the third name changes from set to set, as formats do.
WRITER = """
import itertools, json, sys
from pathlib import Path
from planner.report.replace import replacing
directory = Path(sys.argv[1])
old = json.loads((directory / "summary.json").read_text())["files"]
for run in itertools.count(int(sys.argv[2])):
    names = ["summary.json", "trajectory.npz", f"other{run % 3}.csv"]
    with replacing(directory, old) as new:
        for name in names:
            (new / name).write_text(json.dumps({"run_id": run, "files": names}))
    old = names
    print(run, flush=True)
"""

# The same, but killed before the n-th step it takes in the file system.
KILLED_AT_STEP = """
import json, os, signal, sys
from pathlib import Path
from planner.report.replace import replacing
directory, step, run = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
names = ["summary.json", "trajectory.npz", "new.csv"]
def count(event, args):
    global step
    if event in ("open", "os.rename", "os.link", "os.mkdir", "os.remove", "os.rmdir", "os.scandir", "os.listdir",
                 "ctypes.dlsym", "ctypes.dlopen", "fcntl.flock", "shutil.rmtree", "os.chmod", "os.utime"):
        step -= 1
        if step < 0:
            os.kill(os.getpid(), signal.SIGKILL)
sys.addaudithook(count)
with replacing(directory, ["summary.json", "trajectory.npz", "old.csv"]) as new:
    for name in names:
        (new / name).write_text(json.dumps({"run_id": run, "files": names}))
"""


def write_set(directory: Path, run: int, names: list[str], previous: tuple[str, ...] = ()) -> None:
    with replacing(directory, previous) as new:
        for name in names:
            (new / name).write_text(json.dumps({"run_id": run, "files": names}))


def consistent_run(directory: Path, foreign: tuple[str, ...] = ()) -> int:
    """The run whose set is there, whole, and nothing else."""
    read = {
        file.name: json.loads(file.read_text()) for file in directory.iterdir() if file.name not in foreign
    }
    runs = {content["run_id"] for content in read.values()}
    assert len(runs) == 1, {name: content["run_id"] for name, content in read.items()}
    assert set(read) == set(read["summary.json"]["files"])
    return runs.pop()


def leftovers(place: Path) -> list[Path]:
    return [file for file in place.iterdir() if ".planner-" in file.name]


@linux_only
def test_killed_at_random_moments(tmp_path: Path) -> None:
    directory = tmp_path / "out"
    write_set(directory, 0, ["summary.json", "trajectory.npz", "other0.csv"])
    notes = directory / "notes.txt"
    notes.write_text("mine")
    rng, seen = random.Random(7), set()
    for attempt in range(12):
        command = [sys.executable, "-c", WRITER, str(directory), str(1 + 3000 * attempt)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            process.stdout.readline()  # it is at work now
            time.sleep(rng.uniform(0.0, 0.02))
            process.kill()
        seen.add(consistent_run(directory, ("notes.txt",)))
        assert notes.read_text() == "mine"
    assert len(seen) == 12
    write_set(
        directory, -1, ["summary.json"], tuple(json.loads((directory / "summary.json").read_text())["files"])
    )
    assert not leftovers(tmp_path)
    assert consistent_run(directory, ("notes.txt",)) == -1


@linux_only
def test_killed_before_every_step(tmp_path: Path) -> None:
    """Old before the exchange, new after it, and both are seen; the next run removes what the killed one left."""
    runs = []
    for step in range(200):
        directory = tmp_path / f"{step}" / "out"
        write_set(directory, 1, ["summary.json", "trajectory.npz", "old.csv"])
        (directory / "notes.txt").write_text("mine")
        done = subprocess.run(
            [sys.executable, "-c", KILLED_AT_STEP, str(directory), str(step), "2"], check=False
        )
        runs.append(consistent_run(directory, ("notes.txt",)))
        assert (directory / "notes.txt").read_text() == "mine"
        if done.returncode == 0:
            break
        assert done.returncode == -signal.SIGKILL
        write_set(directory, 3, ["summary.json"], ("trajectory.npz", "old.csv", "new.csv"))
        assert not leftovers(directory.parent)
        assert consistent_run(directory, ("notes.txt",)) == 3
    else:
        pytest.fail("the writer never finished")
    assert runs == sorted(runs)
    assert set(runs) == {1, 2}


def test_new_directory_with_parents(tmp_path: Path) -> None:
    write_set(tmp_path / "a" / "b", 1, ["summary.json"])
    assert consistent_run(tmp_path / "a" / "b") == 1
    assert not leftovers(tmp_path / "a")


def test_the_old_set_goes_and_other_files_stay(tmp_path: Path) -> None:
    directory = tmp_path / "out"
    write_set(directory, 1, ["summary.json", "old.csv"])
    (directory / "job.ngc").write_text("G1")
    (directory / "link").symlink_to("job.ngc")
    inode = (directory / "job.ngc").stat().st_ino
    write_set(directory, 2, ["summary.json", "new.csv"], ("summary.json", "old.csv"))
    assert sorted(os.listdir(directory)) == ["job.ngc", "link", "new.csv", "summary.json"]
    assert (directory / "job.ngc").stat().st_ino == inode
    assert (directory / "link").readlink() == Path("job.ngc")


def test_directory_with_directories_and_current_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    directory = tmp_path / "out"
    (directory / "keep").mkdir(parents=True)
    (directory / "keep" / "file").write_text("mine")
    write_set(directory, 1, ["summary.json", "old.csv"])
    monkeypatch.chdir(directory)
    here = directory.stat().st_ino
    write_set(Path("."), 2, ["summary.json", "new.csv"], ("summary.json", "old.csv"))
    assert directory.stat().st_ino == here
    assert sorted(os.listdir(directory)) == ["keep", "new.csv", "summary.json"]
    assert (directory / "keep" / "file").read_text() == "mine"
    assert not leftovers(directory)
    assert not leftovers(tmp_path)


def test_a_failed_run_changes_nothing(tmp_path: Path) -> None:
    directory = tmp_path / "out"
    write_set(directory, 1, ["summary.json"])
    with contextlib.suppress(KeyboardInterrupt), replacing(directory, ("summary.json",)) as new:
        (new / "summary.json").write_text("half")
        raise KeyboardInterrupt
    assert consistent_run(directory) == 1
    assert not leftovers(tmp_path)


def test_a_run_at_work_is_left_alone(tmp_path: Path) -> None:
    directory = tmp_path / "out"
    with replacing(directory) as first:
        (first / "summary.json").write_text(json.dumps({"run_id": 1, "files": ["summary.json"]}))
        write_set(directory, 2, ["summary.json"])
        assert first.exists()
    assert consistent_run(directory) == 1


def test_a_file_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file")
    with pytest.raises(NotADirectoryError):
        write_set(tmp_path / "out", 1, ["summary.json"])
    assert (tmp_path / "out").read_text() == "a file"
