"""Kernels from the disk: they do what those do that were compiled, and are compiled again when what they compute has changed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from planner.base import kernel_files
from planner.base.kernels import Kernel, njit, text_of
from planner.base.lanes import where

KERNELS = """
from typing import NamedTuple

import numpy as np
from planner.base.kernels import njit
from inner import FACTOR, share

class Parts(NamedTuple):
    whole: float
    each: np.ndarray

@njit()
def parts(x, n=2):
    if n < 1:
        raise ValueError("no parts", 3)
    each = np.empty(n)
    for k in range(n):
        each[k] = share(x, n)
    return Parts(FACTOR * each.sum(), each)

@njit()
def twice(record):
    return 2.0 * record.whole
"""
INNER = """
from planner.base.kernels import njit

FACTOR = 1.0

@njit()
def share(x, n):
    return x / n
"""
USE = """
import numpy as np
from roots import Parts, parts, twice

made = parts(6.0, 3)
assert type(made) is Parts and made.each.dtype == np.float64 and made.each.flags.writeable
try:
    parts(1.0, n=0)
except ValueError as error:
    assert error.args == ("no parts", 3)
assert twice(made) == 2.0 * made.whole
numbers = made.whole, *made.each, parts(6.0, 2).whole
compiled, loaded = (sum(of.values()) for of in (parts.whole.stats.cache_misses, parts.whole.stats.cache_hits))
print(*numbers, "|", compiled, loaded, sum(twice.whole.stats.cache_misses.values()))
"""


@pytest.fixture
def use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """Write two modules of kernels and use them in a process of its own: values | kernels compiled, loaded, compiled."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")

    def run(inner: str = INNER, roots: str = KERNELS) -> str:
        (tmp_path / "inner.py").write_text(inner, encoding="utf-8")
        (tmp_path / "roots.py").write_text(roots, encoding="utf-8")
        (tmp_path / "use.py").write_text(USE, encoding="utf-8")
        command = [sys.executable, str(tmp_path / "use.py")]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    return run


def files(tmp_path: Path) -> list[str]:
    return sorted(file.name for file in (tmp_path / "cache").rglob("*") if file.is_file())


@pytest.mark.slow
def test_kernels_from_the_disk(use: Callable[..., str], tmp_path: Path) -> None:
    assert use() == "6.0 2.0 2.0 2.0 6.0 | 1 0 1"
    written = files(tmp_path)
    assert [name.partition("-")[0] for name in written] == ["roots.parts", "roots.twice"]
    # a comment is nothing to compile for, and half a file is none
    half = tmp_path / "cache" / "planner" / written[1]
    half.write_bytes(half.read_bytes()[:1000])
    assert use(INNER + "# as before\n", "# the same\n" + KERNELS) == "6.0 2.0 2.0 2.0 6.0 | 0 1 1"
    # a kernel inside it, in another file, or a constant is, and takes the place of what was there
    assert use(INNER.replace("x / n", "x / n + 1.0")) == "9.0 3.0 3.0 3.0 8.0 | 1 0 0"
    assert use(INNER.replace("FACTOR = 1.0", "FACTOR = 2.0")) == "12.0 2.0 2.0 2.0 12.0 | 1 0 0"
    assert files(tmp_path) == written


OF_RECORDS = """
import numpy as np

from planner.base.kernels import njit


@njit(cache=True)
def part(rows, n):
    found = 0.0
    for k in range(rows[n]["of"].shape[0]):
        found += rows[n]["of"][k]
    if found < 0.0:
        return part(rows, n + 1)  # a function that calls itself stays one
    return found


@njit(cache=True)
def total(rows):
    found = 0.0
    for n in range(len(rows)):
        found += part(rows, n)
    return found


def records(count):
    rows = np.zeros(3, np.dtype([("before", np.float64), ("of", np.float64, (count,))]))
    rows["of"] = 1.0
    return rows
"""


@pytest.mark.slow
def test_kernels_of_records_of_two_sizes_do_not_mix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiled by two processes, and loaded by a third: numba gives both the same name."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "sums.py").write_text(OF_RECORDS, encoding="utf-8")

    def said(*counts: int) -> str:
        code = (
            "from sums import records, total\n"
            f"print(*(total(records(n)) for n in {counts}), sum(total.whole.stats.cache_hits.values()))"
        )
        command = [sys.executable, "-c", code]
        return subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, check=True
        ).stdout.strip()

    assert said(2) == "6.0 0"
    assert said(9) == "27.0 0"
    assert said(2, 9) == "6.0 27.0 2"


def test_kernels_that_came_with_the_installation_are_found_and_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(kernel_files, "installed", lambda: str(tmp_path / "installed"))
    file = kernel_files.place(six.py_func, six.content, "(float64,)")
    assert kernel_files.read(file) is None
    written = Path(kernel_files.write(file, b"code"))
    assert kernel_files.read(file) == b"code"
    came = tmp_path / "installed" / written.name
    came.parent.mkdir()
    written.rename(came)
    assert kernel_files.read(file) == b"code"
    assert {str(written), str(came)} <= set(kernel_files.used())
    kernel_files.write(file._replace(content=bytes(32)), b"other")  # as another version of it would be
    assert kernel_files.read(file) == b"code"
    assert came.exists()


SIX = 6


@njit(cache=False)
def six(x):
    return x + SIX


def test_what_a_kernel_computes_is_its_content() -> None:
    contents = {six.content}
    for function, settings in (
        (lambda x: x + SIX, {}),
        (lambda x: x + 7, {}),
        (lambda x: x + 7.0, {}),
        (lambda x: x - 7, {}),
        (lambda x: x - 7, {"error_model": "numpy"}),
        (lambda x: six(x), {}),
    ):
        contents.add(Kernel(function, settings, cache=False).content)
    assert len(contents) == 6  # the first is the same as the one before
    assert len({_content_with(text) for text in ("Six more.", "In other words.")}) == 1
    assert len({kernel_files.place(six.py_func, six.content, of).name for of in ("float64", "int64")}) == 2


def _content_with(text: str) -> bytes:
    """The content of a kernel with this docstring."""
    defined: dict[str, Any] = {"where": where}
    exec(f'def seven(x):\n    "{text}"\n    return where(x > 0.0, x, 7.0)', defined)
    return Kernel(defined["seven"], {}, cache=False).content


def test_words_in_a_file_of_intrinsics_compute_nothing(tmp_path: Path) -> None:
    texts = (
        '"""Of one."""\ndef f(x):\n    "Of x."\n    return x',
        '"""Of two."""\ndef f(x):\n    "Of y."\n    return x  # yes',
    )
    other = '"""Of one."""\ndef f(x):\n    "Of x."\n    return -x'
    said = set()
    for k, text in enumerate((*texts, other)):
        file = tmp_path / f"{k}.py"
        file.write_text(text)
        said.add(text_of(str(file)))
    assert len(said) == 2
