"""Kernels on the disk: what is damaged is compiled anew, and what somebody else may have written is not run."""

from __future__ import annotations

import hashlib
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from planner.base import kernel_files
from planner.base.kernel_files import KernelCacheWarning, KernelFile, fault_of, folders, read, write

KERNEL = bytes(range(256)) * 8
FILE = KernelFile("module.kernel-0123.kernel", bytes(32))


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A kernel that was kept."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    written = Path(write(FILE, KERNEL))
    assert read(FILE) == KERNEL
    return written


def test_a_kernel_that_computes_something_else_takes_the_place(file: Path) -> None:
    other = FILE._replace(content=bytes([1] * 32))
    assert read(other) is None
    assert write(other, b"other") == str(file)
    assert (read(other), read(FILE)) == (b"other", None)
    assert [path.name for path in file.parent.iterdir()] == [FILE.name]


def test_a_bit_anywhere_makes_it_another_file(file: Path) -> None:
    whole = file.read_bytes()
    for at in [*range(64), *range(64, len(whole), 29)]:  # the checksum, and places of every kind behind it
        file.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << at % 8]) + whole[at + 1 :])
        assert read(FILE) is None, at


def test_blocks_of_zeros_and_less_or_more_than_all_of_it_are_none(file: Path) -> None:
    """What a power failure and a full disk leave."""
    whole, rng = file.read_bytes(), np.random.default_rng(7)
    for at in rng.integers(0, len(whole) - 512, 50).tolist():
        file.write_bytes(whole[:at] + bytes(512) + whole[at + 512 :])
        assert read(FILE) is None, at
    for length in (0, 1, 31, 32, 33, *rng.integers(34, len(whole) - 1, 50).tolist(), len(whole) - 1):
        file.write_bytes(whole[:length])
        assert read(FILE) is None, length
    file.write_bytes(whole + b"\0")
    assert read(FILE) is None
    file.write_bytes(bytes(len(whole)))
    assert read(FILE) is None
    write(FILE, KERNEL)
    assert read(FILE) == KERNEL


def test_a_file_without_a_checksum_is_not_unpickled(file: Path, tmp_path: Path) -> None:
    class Runs:
        def __reduce__(self) -> tuple:
            return os.mkdir, (str(tmp_path / "ran"),)

    file.write_bytes(pickle.dumps(Runs()))
    assert read(FILE) is None
    assert not (tmp_path / "ran").exists()


def test_an_interrupt_while_a_kernel_is_written_leaves_nothing(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    other = FILE._replace(name="module.other.kernel")
    with pytest.raises(KeyboardInterrupt):
        write(other, KERNEL)
    assert [path.name for path in file.parent.iterdir()] == [FILE.name]


USE = """
from planner.base.kernels import njit

@njit()
def doubled(x):
    return 2.0 * x

@njit()
def halved(x):
    return 0.5 * x

print(doubled(4.5), halved(9.0), sum(sum(kernel.whole.stats.cache_misses.values()) for kernel in (doubled, halved)))
"""


@pytest.mark.slow
def test_a_kernel_that_cannot_be_linked_is_compiled_anew(tmp_path: Path) -> None:
    """Its checksum is right, and it is no pickle, half of one, or one of another kernel."""
    (tmp_path / "use.py").write_text(USE, encoding="utf-8")

    def said() -> str:
        done = subprocess.run(
            [sys.executable, str(tmp_path / "use.py")],
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.strip()

    assert said() == "9.0 4.5 2"
    (doubled, halved) = sorted((tmp_path / "cache").rglob("*.kernel"))
    for path in (doubled, halved):
        rest = path.read_bytes()[32:]
        rest = rest[:32] + b"no pickle" if path == doubled else rest[: len(rest) // 2]
        path.write_bytes(hashlib.sha256(rest).digest() + rest)
    assert said() == "9.0 4.5 2"
    assert said() == "9.0 4.5 0"


def test_without_a_home_the_present_folder_is_none_for_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    """A user without an entry in passwd: `~` stays what it is, and would be a folder where the program lies."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)
    assert all(os.path.isabs(folder) for folder in folders())
    monkeypatch.setattr(kernel_files, "folders", list)
    with pytest.raises(OSError, match="yours alone"):
        write(FILE, KERNEL)
    assert read(FILE) is None


def test_a_relative_cache_home_counts_as_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    for named, wanted in (
        ("", tmp_path / ".cache"),
        (".c", tmp_path / ".cache"),
        (str(tmp_path / "c"), tmp_path / "c"),
    ):
        monkeypatch.setenv("XDG_CACHE_HOME", named)
        assert folders()[-1] == str(wanted / "planner" / "kernels")


def test_an_installation_gets_no_further_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """So that who removes it removes all of it; a checkout keeps its kernels beside the sources."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    package = tmp_path / "site-packages" / "planner"
    package.mkdir(parents=True)
    monkeypatch.setattr(kernel_files, "PACKAGE", str(package))
    of_user = str(tmp_path / "user" / "planner" / "kernels")
    assert folders() == [of_user]
    (package.parent / "pyproject.toml").touch()
    assert folders() == [str(package / "__pycache__" / "kernels"), of_user]


@pytest.mark.parametrize("named", ["kernels", "./kernels", "~/kernels"])
def test_a_cache_that_is_not_absolute_is_refused_with_a_word(
    named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", named)
    with pytest.warns(KernelCacheWarning, match="is not an absolute path"):
        assert not [folder for folder in folders() if not os.path.isabs(folder)]


class TestWhoCanWrite:
    """Owners are those that the tests may make: without the rights of root modes alone are tried."""

    @pytest.fixture(autouse=True)
    def chain(self, tmp_path: Path) -> None:
        self.top, self.leaf = tmp_path / "a", tmp_path / "a" / "b" / "planner"
        self.leaf.mkdir(parents=True)
        assert fault_of(str(self.leaf)) == ""
        assert fault_of(str(self.leaf / "not" / "there")) == ""

    @pytest.mark.parametrize(("mode", "fault"), [(0o777, "by all users"), (0o757, "by all users")])
    def test_others_can_write_it_or_a_parent(self, mode: int, fault: str) -> None:
        for folder in (self.leaf, self.leaf.parent, self.top):
            folder.chmod(mode)
            assert fault in fault_of(str(self.leaf))
            assert fault in fault_of(str(self.leaf / "not" / "there"))
            folder.chmod(0o755)

    def test_a_parent_like_tmp_protects_what_is_in_it(self) -> None:
        self.top.chmod(0o1777)
        assert fault_of(str(self.leaf)) == ""
        self.leaf.chmod(0o1777)  # but not the folder itself: others may put files there
        assert "by all users" in fault_of(str(self.leaf))

    def test_a_link_is_judged_by_where_it_lies_and_where_it_leads(self) -> None:
        link = self.top / "link"
        link.symlink_to(self.leaf)
        assert fault_of(str(link)) == ""
        self.leaf.parent.chmod(0o777)
        assert "by all users" in fault_of(str(link))
        self.leaf.parent.chmod(0o755)
        self.top.chmod(0o777)
        assert "by all users" in fault_of(str(link))

    @pytest.mark.skipif(
        not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root makes other owners"
    )
    def test_it_belongs_to_somebody_else(self, monkeypatch: pytest.MonkeyPatch) -> None:
        for folder in (self.leaf, self.top):
            os.chown(folder, 1234, 1234)
            assert "belongs to user 1234" in fault_of(str(self.leaf))
            monkeypatch.setattr(kernel_files.os, "geteuid", lambda: 1234)
            assert fault_of(str(self.leaf)) == ""
            monkeypatch.undo()
            os.chown(folder, 0, 0)
        os.chown(self.leaf, 0, 4321)
        self.leaf.chmod(0o775)
        assert "by group 4321" in fault_of(str(self.leaf))

    def test_a_file_that_others_can_write_is_not_read(self, file: Path) -> None:
        file.chmod(0o646)
        assert read(FILE) is None
        file.chmod(0o644)
        assert read(FILE) is not None

    def test_without_owners_the_path_alone_counts(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.leaf.chmod(0o777)
        monkeypatch.delattr(os, "geteuid")
        assert fault_of(str(self.leaf)) == ""
        assert fault_of("planner") == "is not an absolute path"
