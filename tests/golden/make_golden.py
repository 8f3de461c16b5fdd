"""Makes jobs.json: `PYTHONPATH=. python tests/golden/make_golden.py` in the repository. Read the diff before committing."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import numpy as np  # noqa: E402
from whole_plans import CORNERS, solve  # noqa: E402

from benchmarks.jobs import problems  # noqa: E402


def results() -> dict[str, Any]:
    """Cycle time, path length, and the corners' reach and speed of the shared jobs on the peers' machine."""
    found = {}
    for name, program in problems.all_jobs().items():
        for kind in CORNERS:
            solved = solve(program, problems.machine(), kind, resolution=5e-4)
            corner = np.flatnonzero(solved.path.d > 0)
            found[f"{name}, {kind}"] = {
                "cycle_time_s": float(solved.time),
                "length_mm": float(solved.samples.s[-1]),
                "corners": len(corner),
                "mean_reach_mm": float(solved.path.d[corner].mean()),
                "pieces": len(solved.samples.piece) - 1,
            }
    return found


if __name__ == "__main__":
    (HERE / "jobs.json").write_text(json.dumps(results(), indent=1) + "\n", encoding="utf-8")
