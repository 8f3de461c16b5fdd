"""A set of output files: whole or seen not to be, never in the place of a file that no run wrote."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from planner.base.errors import InputError
from planner.report import replace
from planner.report.replace import check_output, checksums, replacing, replacing_file, write_new

linux_only = pytest.mark.skipif(sys.platform != "linux", reason="locks and signals of Linux")

# Writes a set over another, and is killed before the n-th step it takes in the file system.
KILLED_AT_STEP = """
import json, os, signal, sys
from pathlib import Path
from planner.report.replace import checksums, replacing
directory, first = Path(sys.argv[1]), int(sys.argv[2])
names = ["trajectory.csv", "trajectory.meta.json", "toolpath.png"]
def count(event, args):
    global step
    if event in ("open", "os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.scandir", "os.listdir", "fcntl.flock", "shutil.rmtree"):
        step -= 1
        if step < 0:
            os.kill(os.getpid(), signal.SIGKILL)
for step in range(first, first + 12):  # a process for a dozen steps, since starting one takes longest
    pid = os.fork()
    if pid == 0:
        sys.addaudithook(count)
        with replacing(directory / str(step)) as new:
            for name in names:
                (new / name).write_text(json.dumps({"run_id": "2"}))
            (new / "summary.json").write_text(json.dumps({"run_id": "2", "files": names, "sha256": checksums(new)}))
        os._exit(0)
    print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
"""


def fill(new: Path, run: str, names: tuple[str, ...]) -> None:
    for name in names:
        (new / name).write_text(json.dumps({"run_id": run}))
    said = {"run_id": run, "files": names, "sha256": checksums(new)}
    (new / "summary.json").write_text(json.dumps(said))


def write_set(directory: Path, run: str, *names: str, force: bool = False) -> None:
    with replacing(directory, force=force) as new:
        fill(new, run, names or ("trajectory.npz",))


def sha256(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def read(file: Path) -> dict:
    return json.loads(file.read_text())


def whole_run(directory: Path) -> str | None:
    """What a reader of the promise makes of a directory: the run whose set is there, None if it cannot tell.

    The run_id of a trajectory (for CSV: of the file beside it) must be that of the summary.
    """
    try:
        run = read(directory / "summary.json")["run_id"]
        trajectory = next(
            name for name in read(directory / "summary.json")["files"] if name.startswith("traj")
        )
        carrier = "trajectory.meta.json" if trajectory == "trajectory.csv" else trajectory
        return run if read(directory / carrier)["run_id"] == run else None
    except FileNotFoundError:
        return None


def leftovers(place: Path) -> list[Path]:
    return list(place.glob(".planner-*"))


@pytest.mark.shows("output", "sampled: killed before every step")
@pytest.mark.slow
@linux_only
def test_killed_before_every_step(tmp_path: Path) -> None:
    """The old set or the new one is there, or the run_id tells that it is neither; the next run cleans up without being forced."""
    runs: list[str | None] = []
    for first in range(0, 120, 12):
        for step in range(first, first + 12):
            write_set(tmp_path / str(step), "1", "trajectory.parquet", "profiles.png", "toolpath.png")
            (tmp_path / str(step) / "notes.txt").write_text("mine")
        done = subprocess.run(
            [sys.executable, "-c", KILLED_AT_STEP, str(tmp_path), str(first)],
            capture_output=True,
            text=True,
            check=True,
        )
        codes = [int(code) for code in done.stdout.split()]
        for step in range(first, first + 12):
            directory = tmp_path / str(step)
            run = whole_run(directory)
            runs.append(run)
            if run is not None:
                said = read(directory / "summary.json")
                assert all((directory / name).is_file() for name in said["files"])
                assert all(sha256(directory / name) == said["sha256"][name] for name in said["files"])
            assert (directory / "notes.txt").read_text() == "mine"
            write_set(directory, "3")
            assert whole_run(directory) == "3"
            assert sorted(os.listdir(directory)) == ["notes.txt", "summary.json", "trajectory.npz"]
        if codes[-1] == 0:
            break
        assert set(codes) <= {-signal.SIGKILL, 0}
    else:
        pytest.fail("the writer never finished")
    seen = [run for k, run in enumerate(runs) if k == 0 or run != runs[k - 1]]
    assert seen == ["1", None, "2"]


def test_new_directory_with_parents_and_none_if_it_fails(tmp_path: Path) -> None:
    write_set(tmp_path / "a" / "b", "1")
    assert whole_run(tmp_path / "a" / "b") == "1"
    with contextlib.suppress(ZeroDivisionError), replacing(tmp_path / "c" / "d"):
        raise ZeroDivisionError
    assert os.listdir(tmp_path) == ["a"]


def test_the_old_set_goes_and_other_files_stay(tmp_path: Path) -> None:
    directory = tmp_path / "out"
    write_set(directory, "1", "trajectory.parquet", "profiles.png")
    (directory / "job.ngc").write_text("G1")
    (directory / "link").symlink_to("job.ngc")
    (directory / "keep").mkdir()
    write_set(directory, "2", "trajectory.npz")
    assert sorted(os.listdir(directory)) == ["job.ngc", "keep", "link", "summary.json", "trajectory.npz"]
    assert (directory / "link").readlink() == Path("job.ngc")


@pytest.mark.skipif(sys.platform == "win32", reason="modes and groups of Unix")
def test_the_directory_keeps_inode_mode_and_group(tmp_path: Path) -> None:
    directory = tmp_path / "out"
    directory.mkdir()
    if os.geteuid() == 0:
        os.chown(directory, 0, 4711)
    directory.chmod(0o2775)  # files of a group's directory belong to the group
    before = directory.stat()
    write_set(directory, "1")
    write_set(directory, "2")
    after = directory.stat()
    for what in ("st_ino", "st_uid", "st_gid", "st_mode"):
        assert getattr(after, what) == getattr(before, what)
    assert (directory / "trajectory.npz").stat().st_gid == before.st_gid


def test_a_failed_run_changes_nothing(tmp_path: Path) -> None:
    directory = tmp_path / "out"
    write_set(directory, "1")
    with contextlib.suppress(KeyboardInterrupt), replacing(directory) as new:
        (new / "summary.json").write_text("half")
        raise KeyboardInterrupt
    assert whole_run(directory) == "1"
    assert not leftovers(directory)


def test_temporaries_go_before_the_process_ends_at_once(tmp_path: Path) -> None:
    with replacing(tmp_path / "new" / "out") as new, replacing_file(tmp_path / "f.csv") as file:
        (new / "summary.json").write_text("half")
        file.write_text("half")
        replace.remove_temporaries()
        assert os.listdir(tmp_path) == []
        new.mkdir(parents=True)
        fill(new, "1", ("trajectory.npz",))
        file.write_text("whole")
    assert whole_run(tmp_path / "new" / "out") == "1"


@linux_only
def test_a_second_run_waits_for_the_first(tmp_path: Path) -> None:
    directory = tmp_path / "out"
    with replacing(directory) as new:
        fill(new, "1", ("trajectory.npz",))
        second = threading.Thread(target=write_set, args=(directory, "2"))
        second.start()
        second.join(0.2)
        assert second.is_alive()
        assert new.exists()
    second.join()
    assert whole_run(directory) == "2"


# ------------------------------------------------------------------------------------------ what no run wrote


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("summary.json", "mine"),
        ("summary.json", '{"sha256": {}}'),
        ("summary.json", "[" * 100_000),
        ("trajectory.npz", "mine"),
        ("trajectory.npz", ""),
    ],
)
def test_a_file_of_the_user_is_not_overwritten(tmp_path: Path, name: str, content: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=r"was not written by planner.*--force"):
        write_set(tmp_path, "1")
    with pytest.raises(InputError, match="--force"):
        check_output(tmp_path, [name])
    assert os.listdir(tmp_path) == [name]
    assert (tmp_path / name).read_text() == content
    write_set(tmp_path, "1", force=True)
    assert whole_run(tmp_path) == "1"


def test_a_file_of_ours_that_was_edited_is_not_overwritten(tmp_path: Path) -> None:
    write_set(tmp_path, "1", "planned.ngc", "trajectory.npz")
    (tmp_path / "planned.ngc").write_text("G1 by hand")
    with pytest.raises(InputError, match="changed since"):
        write_set(tmp_path, "2", "planned.ngc", "trajectory.npz")
    assert whole_run(tmp_path) == "1"
    write_set(tmp_path, "2", "trajectory.npz")  # nor is it removed where the new set lacks it
    assert (tmp_path / "planned.ngc").read_text() == "G1 by hand"


def test_an_edited_summary_removes_nothing(tmp_path: Path) -> None:
    write_set(tmp_path / "out", "1", "trajectory.npz")
    victims = [tmp_path / "victim", tmp_path / "out" / "mine.txt", tmp_path / "out" / "profiles.png"]
    for victim in victims:
        victim.write_text("mine")
    said = read(tmp_path / "out" / "summary.json")
    named = {"../victim": "0", str(victims[0]): "0", "profiles.png": "0"}
    named["mine.txt"] = sha256(tmp_path / "out" / "mine.txt")
    said |= {"files": list(named), "sha256": said["sha256"] | named}
    (tmp_path / "out" / "summary.json").write_text(json.dumps(said))
    write_set(tmp_path / "out", "2", "trajectory.csv", "trajectory.meta.json")
    assert all(victim.read_text() == "mine" for victim in victims)
    assert not (tmp_path / "out" / "trajectory.npz").exists()


def test_links_and_directories_are_not_ours(tmp_path: Path) -> None:
    write_set(tmp_path / "out", "1")
    (tmp_path / "elsewhere").write_bytes((tmp_path / "out" / "trajectory.npz").read_bytes())
    (tmp_path / "out" / "trajectory.npz").unlink()
    (tmp_path / "out" / "trajectory.npz").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="--force"):
        write_set(tmp_path / "out", "2")
    (tmp_path / "out" / "trajectory.npz").unlink()
    (tmp_path / "out" / "trajectory.npz").mkdir()
    with pytest.raises(InputError, match="is a directory"):
        write_set(tmp_path / "out", "2", force=True)


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file")
    with pytest.raises(InputError, match="is a file, not a directory"):
        write_set(tmp_path / "out", "1")
    with pytest.raises(InputError, match="cannot be written"):
        write_set(tmp_path / "out" / "deeper", "1")
    with pytest.raises(InputError, match="cannot be written: File name too long"):
        write_set(tmp_path / ("n" * 300), "1")
    with pytest.raises(InputError, match="cannot be written"), replacing_file(tmp_path / "out" / "f.csv"):
        pytest.fail("there is no such directory")
    with (
        pytest.raises(InputError, match="cannot be written: File name too long"),
        replacing_file(tmp_path / ("n" * 300)) as new,
    ):
        new.write_text("1")
    assert os.listdir(tmp_path) == ["out"]
    name = "n" * 250  # what a file system takes, the place of a temporary takes, too
    with replacing_file(tmp_path / name) as new:
        new.write_text("1")
    assert (tmp_path / name).read_text() == "1"


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc here")
def test_a_directory_that_cannot_be_made_is_told_before_planning() -> None:
    with pytest.raises(InputError, match="cannot be written"):
        check_output(Path("/proc/none/plan"), ())


def test_a_check_leaves_nothing_behind(tmp_path: Path) -> None:
    check_output(tmp_path / "a" / "b", ())
    assert not list(tmp_path.iterdir())


@linux_only
@pytest.mark.parametrize("force", [False, True])
def test_a_new_file_is_whole_or_not_there(force: bool, tmp_path: Path) -> None:
    """A full disk left the first part of a machine file, and with --force nothing of the old one."""
    import resource

    file, before = tmp_path / "my.toml", b"old" if force else None
    if before is not None:
        file.write_bytes(before)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(InputError, match="cannot be written"):
            write_new(file, b"x" * 300_000, force=force)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [one.read_bytes() for one in tmp_path.iterdir()] == [before] * force
