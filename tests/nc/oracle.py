"""LinuxCNC's own interpreter as an oracle: asked where it is installed, and its recorded answers to programs of the project everywhere.

`benchmarks/controls/linuxcnc_canon.py` asks it, in a process of its own. Its answers to random programs of the project are kept,
with their texts, in `linuxcnc_answers.json.gz`; `python -m benchmarks.controls.linuxcnc_answers` makes that file, and
test_random_agreement.py checks that it is current where LinuxCNC is there. Numbers are kept to DIGITS digits.
"""

from __future__ import annotations

import gzip
import itertools
import json
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.base.arrays import Array

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
SHARED = Path(os.environ.get("PLANNER_SHARED", ROOT.parent / "shared"))
CANON = ROOT / "benchmarks" / "controls" / "linuxcnc_canon.py"
ANSWERS = HERE / "linuxcnc_answers.json.gz"
PYTHON = "/usr/bin/python3"
SECONDS_MAX = 300  # of one run of the oracle
DIGITS = 13  # the comparison allows 1e-9 mm and 1e-12 of a number

ORACLE_MISSING = None
if shutil.which("rs274") is None:
    ORACLE_MISSING = "rs274 (Debian package linuxcnc-uspace) is not installed"
elif subprocess.run([PYTHON, "-c", "import gcode, numpy"], capture_output=True, check=False).returncode:
    ORACLE_MISSING = f"{PYTHON} has no module gcode (Debian package linuxcnc-uspace) or no numpy"
needs_oracle = pytest.mark.skipif(ORACLE_MISSING is not None, reason=str(ORACLE_MISSING))


@dataclass(frozen=True)
class Canon:
    """Moves as LinuxCNC issues them (columns: see linuxcnc_canon.py), and its error or an empty text."""

    move: Array
    further: Array
    error: str


def ask_oracle(jobs: list[dict], folder: Path) -> list[Canon]:
    todo, out = folder / "jobs.json", folder / "out.npz"
    todo.write_text(json.dumps(jobs))
    done = subprocess.run(
        [PYTHON, str(CANON), str(todo), str(out)],
        capture_output=True,
        text=True,
        timeout=SECONDS_MAX,
        check=False,
    )
    assert done.returncode == 0, f"the oracle failed with {done.returncode}: {done.stderr[-2000:]}"
    with np.load(out) as data:
        return [
            Canon(data[f"{k}.move"], data[f"{k}.further"], str(data[f"{k}.error"])) for k in range(len(jobs))
        ]


def asked(texts: list[str], setup: dict[str, Any], folder: Path) -> list[Canon]:
    """What LinuxCNC makes of texts, with its offsets and tools in `setup`."""
    return asked_of_kinds({"": (texts, setup)}, folder)[""]


def asked_of_kinds(
    programs: dict[str, tuple[list[str], dict[str, Any]]], folder: Path
) -> dict[str, list[Canon]]:
    """The same of texts and setup by kind, in one run of the oracle: to start it takes as long as to read a hundred programs."""
    jobs: list[dict] = []
    for texts, setup in programs.values():
        for text in texts:
            path = folder / f"{len(jobs)}.ngc"
            path.write_text(text)
            jobs.append({"path": str(path), **setup})
    answers = iter(ask_oracle(jobs, folder))
    return {kind: list(itertools.islice(answers, len(texts))) for kind, (texts, _) in programs.items()}


# --- recorded answers ---------------------------------------------------------------------------------------------------------


def record(programs: dict[str, tuple[list[str], dict[str, Any]]]) -> bytes:
    """The file of answers: texts and setup of each kind, as LinuxCNC reads them now."""
    with tempfile.TemporaryDirectory() as folder:
        answers = asked_of_kinds(programs, Path(folder))
    kinds = {
        kind: [
            {"text": text, "error": found.error, "move": _short(found.move), "further": _short(found.further)}
            for text, found in zip(texts, answers[kind], strict=True)
        ]
        for kind, (texts, _) in programs.items()
    }
    return gzip.compress(json.dumps(kinds, separators=(",", ":")).encode(), mtime=0)


@cache
def recorded() -> dict[str, list[tuple[str, Canon]]]:
    """Texts and what LinuxCNC made of them, by kind."""
    found = json.loads(gzip.decompress(ANSWERS.read_bytes()))
    return {kind: [(one["text"], _answer(one)) for one in programs] for kind, programs in found.items()}


def _answer(one: dict[str, Any]) -> Canon:
    move = np.array(one["move"], dtype=float).reshape(11, -1).T
    further = np.array(one["further"] or np.zeros((6, len(move)))).reshape(6, -1).T
    return Canon(move, further, one["error"])


def _short(rows: Array) -> list[list[float]]:
    """Columns of numbers; none where all are 0."""
    if not rows.any():
        return []
    return [[_number(v) for v in column] for column in rows.T.tolist()]


def _number(value: float) -> float | int:
    short = float(f"{value:.{DIGITS}g}")
    return int(short) if short.is_integer() else short
