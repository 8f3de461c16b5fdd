"""Plan and verify every program of a folder: does each end with a verdict or a reason, and what does it take?

    python -m benchmarks.nc_programs FOLDER -m MACHINE.toml [--method NAME] [--corner NAME] [--name RESULT]

Every file is planned in a process of its own, so that peak memory is the file's and nothing can take the others down.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import time
from pathlib import Path
from typing import Any

from benchmarks.record import markdown, write_results

KEEP_OUT = (".csv", ".md", ".txt")


def main() -> None:
    """Run all programs and write results/RESULT.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("-m", "--machine", required=True)
    parser.add_argument("--method", default="optimal")
    parser.add_argument("--corner", default="auto")
    parser.add_argument("--name", default="jerk-nc-programs")
    parser.add_argument("--only", nargs="*", default=[], help="parts of file names")
    options = parser.parse_args()
    files = sorted(file for file in options.folder.iterdir() if file.suffix not in KEEP_OUT)
    files = [file for file in files if not options.only or any(part in file.name for part in options.only)]
    rows = []
    context = multiprocessing.get_context("spawn")
    for file in files:
        began = time.perf_counter()
        receive, send = context.Pipe(duplex=False)
        process = context.Process(
            target=_run, args=(send, str(file), options.machine, options.method, options.corner)
        )
        process.start()
        send.close()
        try:
            row = receive.recv()
        except EOFError:
            row = {"outcome": "crashed", "message": f"the process ended with {process.exitcode}"}
        process.join()
        row |= {"program": file.name, "wall_s": round(time.perf_counter() - began, 2)}
        rows.append(row)
        print(file.name, json.dumps(row)[:200], flush=True)
        write_results(
            options.name, {"method": options.method, "corner": options.corner, "programs": rows}, _table(rows)
        )  # a kill loses nothing


def _run(pipe: Any, file: str, machine: str, method: str, corner: str) -> None:
    """Plan one file; everything that can go wrong is an outcome."""
    import planner

    try:
        plan = planner.plan(file, machine, method=method, corner=corner)
    except planner.InputError as fault:
        pipe.send({"outcome": "refused", "message": str(fault).replace(file, Path(file).name)})
        return
    except Exception as fault:
        pipe.send({"outcome": "crashed", "message": repr(fault)})
        raise
    row: dict[str, Any] = {
        "outcome": "not solved",
        "message": plan.sentence,
        "blocks": len(plan.program),
        "grid_points": plan.grid_points,
        "stop_s": plan.stop_time,
        "timings_s": {name: round(seconds, 3) for name, seconds in plan.timings.items()},
        "peak_gb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, 2),
    }
    if plan.verdict is not None and plan.trajectory is not None:
        verdict = plan.verdict
        row |= {
            "outcome": "passed" if verdict.passed else "failed",
            "message": "; ".join(verdict.faults[:3]),
            "cycle_s": plan.trajectory.cycle_time,
            "samples": len(plan.trajectory),
            "limits": {name: check.ratio for name, check in verdict.limits.items() if check.limited},
            "not_limited": {name: check.ratio for name, check in verdict.limits.items() if not check.limited},
            "contour_mm": verdict.contour_error_mm,
            "vertex_mm": verdict.vertex_error_mm,
            "corner_speed_ratio": plan.corners.worst_ratio() if plan.corners is not None else None,
        }
    pipe.send(row)


def _table(rows: list[dict[str, Any]]) -> str:
    columns = [
        "program", "blocks", "grid points", "cycle [s]", "stops [s]", "worst limit", "contour, vertex [um]",
        "corner/eq. 19-20", "read, geometry, solve, sample, verify [s]", "peak [GB]", "outcome",
    ]  # fmt: skip
    lines = []
    for row in rows:
        if "cycle_s" not in row:
            lines.append([row["program"], *[""] * 9, f"{row['outcome']}: {row['message']}"])
            continue
        times = row["timings_s"]
        name, worst = max(row["limits"].items(), key=lambda item: item[1])
        corner = row["corner_speed_ratio"]
        outcome = row["outcome"] + (f": {row['message']}" if row["message"] else "")
        lines.append(
            [
                row["program"],
                f"{row['blocks']:,}",
                f"{row['grid_points']:,}",
                f"{row['cycle_s']:.3f}",
                f"{row['stop_s']:.3f}",
                f"{worst:.6f} {name}",
                f"{row['contour_mm'] * 1e3:.2f}, {row['vertex_mm'] * 1e3:.2f}",
                "" if corner is None else f"{corner:.6f}",
                ", ".join(
                    f"{times.get(stage, 0):.2f}"
                    for stage in ("read", "geometry", "solve", "sample", "verify")
                ),
                f"{row['peak_gb']:.2f}",
                outcome,
            ]
        )
    return markdown(columns, lines)


if __name__ == "__main__":
    main()
