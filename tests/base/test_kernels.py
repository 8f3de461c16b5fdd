"""The cache of compiled kernels: what another version of the package has left in it does no harm."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numba
import pytest

SOURCE = """
from typing import NamedTuple
from planner.base.kernels import njit

class {name}(NamedTuple):
    x: float

@njit(cache=True)
def doubled(record):
    return 2.0 * record.x
"""


def test_an_index_that_names_a_class_that_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """numba reads all of a kernel's index, and fails, before it looks whether its source has changed."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")  # beside the source, whatever NUMBA_CACHE_DIR says
    for name in ("Before", "AfterTheUpdate"):
        (tmp_path / "kernel_of_record.py").write_text(SOURCE.format(name=name), encoding="utf-8")
        sys.modules.pop("kernel_of_record", None)
        importlib.invalidate_caches()
        module = importlib.import_module("kernel_of_record")
        assert module.doubled(getattr(module, name)(1.5)) == 3.0
    sys.modules.pop("kernel_of_record", None)
    assert len(list(tmp_path.rglob("*.nbi"))) == 1
