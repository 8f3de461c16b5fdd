"""What smoothing takes, and whether every curve has its certificate: splines for every program of a folder, without planning them.

    python -m benchmarks.smoothing FOLDER -m MACHINE.toml [--name RESULT]

Processor times of the second of two calls, so that loading the kernels does not count. Runs without a certificate keep their single
corners.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from benchmarks.nc_programs import KEEP_OUT
from benchmarks.record import markdown, write_results
from planner.base.errors import InputError
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.geometry.build import toolpath_from_program
from planner.machine import Machine, load_machine
from planner.methods.optimal import SIGMA2
from planner.nc.reader import read_program
from planner.smoothing.spline_path import spline_shape


def main() -> None:
    """Run all programs and write results/RESULT.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("-m", "--machine", required=True)
    parser.add_argument("--name", default="smoothing")
    options = parser.parse_args()
    machine = load_machine(options.machine)
    rows = []
    for file in sorted(file for file in options.folder.iterdir() if file.suffix not in KEEP_OUT):
        try:
            rows.append(_smoothed(file, machine))
        except InputError:
            continue  # benchmarks/nc_programs.py says why
        print(rows[-1], flush=True)
        write_results(options.name, {"programs": rows}, _table(rows))


def _smoothed(file: Path, machine: Machine) -> dict[str, Any]:
    """One program."""
    toolpath = toolpath_from_program(read_program(str(file), machine), machine, None)
    path = round_corners(toolpath, machine, BezierCorner(sigma2=SIGMA2), blend_tangents=True)
    for _ in range(2):
        began = time.process_time()
        shape = spline_shape(path, machine)
        took = time.process_time() - began
    blocks = len(toolpath.block)
    return {
        "program": file.name,
        "blocks": blocks,
        "runs": len(shape.splines.fits),
        "certified": int(shape.splines.fits.sum()),
        "spans": len(shape.left),
        "took_s": took,
        "us_per_block": 1e6 * took / max(blocks, 1),
        "us_per_span": 1e6 * took / max(len(shape.left), 1),
    }


def _table(rows: list[dict[str, Any]]) -> str:
    columns = [
        "program",
        "blocks",
        "runs",
        "certified",
        "spans",
        "smoothing [s]",
        "us per block",
        "us per span",
    ]
    lines = [
        [
            row["program"], f"{row['blocks']:,}", f"{row['runs']}", f"{row['certified']}", f"{row['spans']:,}", f"{row['took_s']:.3f}",
            f"{row['us_per_block']:.1f}", f"{row['us_per_span']:.1f}",
        ]
        for row in rows
    ]  # fmt: skip
    return markdown(columns, lines)


if __name__ == "__main__":
    main()
