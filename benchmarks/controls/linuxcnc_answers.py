"""LinuxCNC's answers to random programs, recorded for the tests that compare the reader with them.

    python -m benchmarks.controls.linuxcnc_answers

Writes tests/nc/linuxcnc_answers.json.gz: programs of the generators of tests/nc from one seed, and what LinuxCNC's interpreter
makes of them (benchmarks/controls/linuxcnc_canon.py). It needs rs274 and the module gcode (Debian package linuxcnc-uspace); the
tests that read the file need nothing.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import numpy as np

TESTS = Path(__file__).resolve().parents[2] / "tests" / "nc"
SEED = 41
COUNT = {"splines": 10, "together": 24, "language": 32}  # LinuxCNC writes a spline as hundreds of lines
OTHERS = 80  # of the other kinds


def programs() -> dict[str, tuple[list[str], dict[str, Any]]]:
    """Texts of each kind, and the offsets and tools with which LinuxCNC reads them."""
    sys.path[:0] = [folder for folder in (str(TESTS), str(TESTS / "language")) if folder not in sys.path]
    agreement, random = (
        importlib.import_module(f"test_{name}") for name in ("agreement", "random_agreement")
    )
    kinds = dict.fromkeys(random.KINDS, agreement.offsets_in_inches())
    makers = random.KINDS | {
        "nine axes": importlib.import_module("test_further").random_text,
        "language": lambda rng: importlib.import_module("language_programs").Generator(rng).text(),
    }
    found = {}
    for kind, make in makers.items():
        rng = np.random.default_rng(SEED)
        found[kind] = [make(rng) for _ in range(COUNT.get(kind, OTHERS))], kinds.get(kind, {})
    return found


def main() -> None:
    """Write the file."""
    made = programs()
    oracle = importlib.import_module("oracle")
    oracle.ANSWERS.write_bytes(oracle.record(made))
    count = sum(len(texts) for texts, _ in made.values())
    print(f"{count} programs, {oracle.ANSWERS.stat().st_size:,} bytes in {oracle.ANSWERS}")


if __name__ == "__main__":
    main()
