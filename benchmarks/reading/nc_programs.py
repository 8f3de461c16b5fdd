"""Plan and verify every program of a folder: does each end with a verdict or a reason, and what does it take?

    python -m benchmarks.reading.nc_programs FOLDER -m MACHINE.toml [--method NAME] [--corner NAME ...] [--processes N]
                                     [--quick-above BLOCKS] [--limit SECONDS] [--extruder ignore] [--name RESULT] [--resume]

Every file is planned in a process of its own, so that peak memory is the file's and nothing can take the others down; with several
corners once with each, and what the first of them gains over the others is in the table. Programs of more than `--quick-above`
blocks are planned with `--effort quick`; one that takes longer than `--limit` is ended, which is its outcome. `--resume` keeps what
the result holds already, but for what was ended or crashed; every row names the commit it was made with.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import statistics
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.record import RESULTS, markdown, provenance, write_results

KEEP_OUT = (".csv", ".md", ".txt")
AGAIN = ("crashed", "ended")  # outcomes that `--resume` plans once more


def main() -> None:
    """Run all programs and write results/RESULT.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("-m", "--machine", required=True)
    parser.add_argument("--method", default="optimal")
    parser.add_argument("--corner", nargs="+", default=["auto", "bezier"])
    parser.add_argument("--name", default="nc-programs")
    parser.add_argument("--only", nargs="*", default=[], help="parts of file names")
    parser.add_argument("--processes", type=int, default=1, help="programs planned at the same time")
    parser.add_argument("--quick-above", type=int, default=0, help="blocks; 0: never")
    parser.add_argument("--limit", type=float, default=None, help="seconds for each program")
    parser.add_argument("--extruder", default="refuse", choices=("refuse", "ignore"))
    parser.add_argument("--resume", action="store_true", help="keep the rows of an earlier run")
    options = parser.parse_args()
    files = [file for file in options.folder.iterdir() if file.suffix not in KEEP_OUT]
    files.sort(key=lambda file: file.stat().st_size)  # the small ones first, so that most is there soon
    files = [file for file in files if not options.only or any(part in file.name for part in options.only)]
    rows: list[dict[str, Any]] = []
    if options.resume:
        rows = json.loads((RESULTS / f"{options.name}.json").read_text(encoding="utf-8"))["programs"]
        rows = [row for row in rows if row["outcome"] not in AGAIN]
    done = {(row["program"], row["corner"]) for row in rows}
    refused = {row["program"] for row in rows if row["outcome"] == "refused"}
    place = {file.name: number for number, file in enumerate(files)}
    writing = threading.Lock()

    def plan_all(file: Path) -> None:
        for corner in options.corner:
            if (file.name, corner) in done or file.name in refused:
                continue
            row = _in_own_process(file, options, corner)
            with writing:
                rows.append(row)
                rows.sort(key=lambda own: place.get(own["program"], len(place)))
                print(file.name, json.dumps(row)[:200], flush=True)
                data = {"method": options.method, "corners": options.corner, "programs": rows}
                write_results(options.name, data, _table(rows, options.corner))  # a kill loses nothing
            if row["outcome"] == "refused":
                break

    with ThreadPoolExecutor(options.processes) as pool:
        for finished in [pool.submit(plan_all, file) for file in files]:
            finished.result()


def _in_own_process(file: Path, options: argparse.Namespace, corner: str) -> dict[str, Any]:
    """One file with one corner, ended after the time limit."""
    began = time.perf_counter()
    context = multiprocessing.get_context("spawn")
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(send, str(file), options, corner))
    process.start()
    send.close()
    row: dict[str, Any]
    try:
        if receive.poll(options.limit):
            row = receive.recv()
        else:
            process.kill()
            row = {"outcome": "ended", "message": f"after the limit of {options.limit:g} s"}
    except EOFError:
        row = {"outcome": "crashed", "message": f"the process ended with {process.exitcode}"}
    process.join()
    wall = round(time.perf_counter() - began, 2)
    return row | {"program": file.name, "corner": corner, "wall_s": wall, "commit": provenance()["commit"]}


def _run(pipe: Any, file: str, options: argparse.Namespace, corner: str) -> None:
    """Plan one file; everything that can go wrong is an outcome."""
    import planner

    began = time.process_time()
    try:
        program = planner.read_program(
            file, planner.load_machine(options.machine), planner.Reading(extruder=options.extruder)
        )
        read_s = time.process_time() - began
        effort = "quick" if 0 < options.quick_above < len(program) else None
        plan = planner.plan(program, options.machine, method=options.method, corner=corner, effort=effort)
    except planner.InputError as fault:
        pipe.send({"outcome": "refused", "message": str(fault).replace(file, Path(file).name)})
        return
    except Exception as fault:
        pipe.send({"outcome": "crashed", "message": repr(fault)})
        raise
    row: dict[str, Any] = {
        "outcome": "not solved",
        "message": plan.sentence,
        "sentence": plan.sentence,
        "blocks": len(plan.program),
        "dialect": _dialect(program),
        "effort": effort or "",
        "notes": list(plan.notes),
        "read_s": round(read_s, 3),
        "grid_points": plan.grid_points,
        "stop_s": plan.stop_time,
        "timings_s": {name: round(seconds, 3) for name, seconds in plan.timings.items()},
        "cpu_s": round(time.process_time(), 2),
        "peak_gb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, 2),
    }
    if plan.verdict is not None and plan.trajectory is not None:
        verdict = plan.verdict
        row |= {
            "outcome": "passed" if verdict.passed else "failed",
            "message": "; ".join(verdict.sentences[:3]),
            "cycle_s": plan.trajectory.cycle_time,
            "samples": len(plan.trajectory),
            "limits": {name: check.ratio for name, check in verdict.limits.items() if check.limited},
            "not_limited": {name: check.ratio for name, check in verdict.limits.items() if not check.limited},
            "contour_mm": verdict.contour_error_mm,
            "vertex_mm": verdict.vertex_error_mm,
            "corner_speed_ratio": verdict.corners.worst_ratio,
        }
    pipe.send(row)


def _dialect(program: Any) -> str:
    """Whose language a program is in, as the reader took it."""
    if program.pen:
        return "HPGL"
    return "RS274NGC" if program.expansion is None else program.expansion.dialect


def _table(rows: list[dict[str, Any]], corners: list[str]) -> str:
    """One line for each program: all about the first corner, and the cycle times with the others over its own."""
    columns = [
        "program", "dialect", "effort", "notes", "blocks", "blocks/s", "grid points",
        f"cycle, {corners[0]} [s]", *(f"{other} / {corners[0]}" for other in corners[1:]),
        "stops [s]", "worst limit", "contour, vertex [um]", "corner/eq. 19-20", "read, geometry, solve, sample, verify [s]",
        "CPU of all [s]", "peak [GB]", "outcome",
    ]  # fmt: skip
    compared: dict[str, list[float]] = {other: [] for other in corners[1:]}
    cycles = {(row["program"], row["corner"]): row["cycle_s"] for row in rows if "cycle_s" in row}
    lines = []
    for row in rows:
        if row["corner"] != corners[0]:
            continue
        if "cycle_s" not in row:
            blank = [""] * (len(columns) - 2)
            lines.append([row["program"], *blank, f"{row['outcome']}: {row['message']}"])
            continue
        ratios = []
        for other in corners[1:]:
            cycle = cycles.get((row["program"], other))
            ratios.append("" if cycle is None else f"{cycle / row['cycle_s']:.4f}")
            if cycle is not None:
                compared[other].append(cycle / row["cycle_s"])
        times = row["timings_s"]
        name, worst = max(row["limits"].items(), key=lambda item: item[1])
        corner = row["corner_speed_ratio"]
        outcome = row["outcome"] + (f": {row['message']}" if row["message"] else "")
        lines.append(
            [
                row["program"],
                row.get("dialect", ""),
                row.get("effort", ""),
                str(len(row["notes"])) if "notes" in row else "",
                f"{row['blocks']:,}",
                f"{row['blocks'] / row['cpu_s']:,.0f}" if row["cpu_s"] else "",
                f"{row['grid_points']:,}",
                f"{row['cycle_s']:.3f}",
                *ratios,
                f"{row['stop_s']:.3f}",
                f"{worst:.6f} {name}",
                f"{row['contour_mm'] * 1e3:.2f}, {row['vertex_mm'] * 1e3:.2f}",
                "" if corner is None else f"{corner:.6f}",
                ", ".join(
                    f"{times.get(stage, 0):.2f}"
                    for stage in ("read", "geometry", "solve", "sample", "verify")
                ),
                f"{row['cpu_s']:.1f}",
                f"{row['peak_gb']:.2f}",
                outcome,
            ]
        )
    text = markdown(columns, lines)
    for other, ratio in compared.items():
        if ratio:
            text += (
                f"\n{other} / {corners[0]}: {statistics.geometric_mean(ratio):.4f} in the geometric mean of {len(ratio)} programs, "
                f"{min(ratio):.4f} to {max(ratio):.4f}\n"
            )
    failed = [
        f"{row['program']} ({row['corner']}): {row['outcome']}: {row['message']}"
        for row in rows
        if row["corner"] != corners[0] and row["outcome"] != "passed"
    ]
    counts = Counter(row["outcome"] for row in rows if row["corner"] == corners[0])
    text += "\n" + ", ".join(f"{count} {outcome}" for outcome, count in counts.most_common()) + "\n"
    return text + "".join(f"\n* {line}" for line in failed)


if __name__ == "__main__":
    main()
