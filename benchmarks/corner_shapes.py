"""Which corner shape is fastest for the jerk-limited optimum? Single corners of 10 to 170 degrees between legs of 20 mm.

    python -m benchmarks.corner_shapes

Machine v 100 mm/s, a 2000 mm/s2, j 2e5 mm/s3 per axis, 1 ms; tolerances 0.01 and 0.05 mm; the first leg along x, or turned so that the
corner's bisector is at 45 degrees to the axes. What is compared is the time lost at the corner: the cycle time of method `optimal` on
that shape, less that of a straight line of 40 mm. The shapes, each using the whole tolerance:

    bezier s     rational pair with sigma2 = s, G3 at its joint (paper 002)
    fir c r      overlap of two filtered pulses (paper 000) with Tk = c Td and T2 = r T1; c and r are all that its shape depends on,
                 for Tk <= T2 it is the polynomial pair, "bezier 1" (docs/papers.md B1)
    fir          the shape that `--corner fir` takes, filters from the machine's limits
    kinematic    `--corner kinematic` (paper 003): Tk = Td, T2/T1 from the limits at each corner
    stop         a full stop at the vertex

Results: benchmarks/results/corner-shapes.json, .md and .png. What they say, of 37 ms that the fastest shape loses on average and 48 to
60 ms that a stop does:

* no shape is the fastest at every angle, but the polynomial pair, which is the FIR overlap up to Tk = T2, is within 2.1 ms of it
  everywhere and 0.3 ms on average, "bezier 0.94" within 1.5 and 0.4 ms: one shape for all corners gives away 1 %;
* from 60 degrees on the polynomial pair and short overlaps with T2 near T1 are the fastest, from 30 to 50 "bezier 0.94", below longer
  overlaps: "fir 0.8 0.5" is within 0.6 ms at 10 and 20 degrees, where "fir" and "bezier 1" lose up to 3 ms more;
* what costs is a short T2, which is jerk of the shape itself (all with r <= 0.2 lose 4 to 20 ms more on average), and from 30 degrees
  on a complete overlap: the kinematic corner loses up to 11 ms more than the fastest, which it is at 10 and 20 degrees only.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from benchmarks import problems
from benchmarks.record import RESULTS, markdown, write_results
from planner.corners.bezier import BezierCorner
from planner.corners.fir import FirCorner
from planner.corners.smooth import CornerShape
from planner.machine import Machine
from planner.methods.optimal import OptimalMethod
from planner.methods.stop import StopMethod
from planner.nc.program import Program

ANGLES = range(10, 180, 10)  # [deg]
TOLERANCES = (0.01, 0.05)  # [mm]
ORIENTATIONS = {
    "along x": lambda theta: 0.0,
    "bisector at 45 degrees": lambda theta: np.pi / 4 + (np.pi - theta) / 2,
}
LEG = 20.0  # [mm]
SIGMA2 = (0.85, 0.94, 1.0, 1.2)
OVERLAPS, RATIOS = (0.6, 0.8, 1.0), (1.0, 0.5, 0.2, 0.05)
EXCESS = 2e-4  # that a limit may be exceeded by [-]: on extreme shapes the last digits of the jerk are not always settled
DRAWN = (
    "bezier 0.85",
    "bezier 0.94",
    "bezier 1",
    "bezier 1.2",
    "fir",
    "fir 0.6 1",
    "fir 0.8 0.5",
    "fir 1 1",
    "kinematic",
)
WITHIN = 0.2  # [ms] that a shape may lose more than the fastest and still count as good as it
Shapes = dict[str, CornerShape | str]


def corner(theta: float, first: float) -> Program:
    """Two legs that turn by theta [rad], the first at the angle `first` [rad] to x."""
    at = [first, first + theta]
    steps = LEG * np.stack([np.cos(at), np.sin(at)], axis=1)
    return problems.polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]))


def fir_shape(overlap: float, ratio: float, middle: float) -> FirCorner:
    """Filters T2 = ratio T1 for which the overlap Tk = overlap Td has the middle value [mm]."""
    unit = FirCorner(T1=1.0, T2=ratio, feed_max=problems.FEED)
    T1 = middle / problems.FEED / float(unit.ramp(np.array(overlap * (1 + ratio) / 2)))
    return FirCorner(T1=T1, T2=ratio * T1, feed_max=problems.FEED)


def shapes(theta: float, tolerance: float) -> Shapes:
    """The shapes to compare at a corner."""
    middle = tolerance / (2 * np.sin(theta / 2))  # eps = 2 m sin(theta/2)
    made: Shapes = {f"bezier {s:g}": BezierCorner(sigma2=s) for s in SIGMA2}
    made |= {f"fir {c:g} {r:g}": fir_shape(c, r, middle) for c in OVERLAPS for r in RATIOS}
    return made | {"fir": "fir", "kinematic": "kinematic"}


def lost_times(theta: float, first: float, machine: Machine) -> dict[str, float]:
    """Time lost by shape [ms]."""
    straight = StopMethod().plan(problems.polyline([[0.0, 0.0], _along(first)]), machine).require()
    job = corner(theta, first)
    made: dict[str, Callable] = {
        name: OptimalMethod(corner=shape).plan for name, shape in shapes(theta, machine.tolerance).items()
    }
    lost = {}
    for name, plan in (made | {"stop": StopMethod().plan}).items():
        result = plan(job, machine).require()
        worst = max(check.ratio for check in result.verdict.limits.values())
        assert worst <= 1 + EXCESS, (name, theta, result.verdict.faults)
        lost[name] = 1e3 * (result.trajectory.cycle_time - straight.trajectory.cycle_time)
    return lost


def _along(first: float) -> list[float]:
    return [2 * LEG * np.cos(first), 2 * LEG * np.sin(first)]


def main() -> None:
    """Run all corners and write the table and the figure."""
    rows: list[dict[str, Any]] = []
    for orientation, turned in ORIENTATIONS.items():
        for tolerance in TOLERANCES:
            machine = problems.machine(tolerance=tolerance)
            for degrees in ANGLES:
                theta = np.deg2rad(degrees)
                lost = lost_times(theta, turned(theta), machine)
                rows.append(
                    {
                        "orientation": orientation,
                        "tolerance": tolerance,
                        "theta_deg": degrees,
                        "lost_ms": lost,
                    }
                )
                best = min(lost, key=lost.__getitem__)
                print(orientation, tolerance, degrees, best, f"{lost[best]:.2f} ms", flush=True)
    write_results("corner-shapes", {"rows": rows}, _table(rows))
    _figure(rows)


def _table(rows: list[dict[str, Any]]) -> str:
    names = list(rows[0]["lost_ms"])
    shown = ["bezier 0.94", "bezier 1", "fir", "kinematic", "stop"]
    text = "Time lost at one corner [ms] in the jerk-limited optimum.\n"
    for orientation in ORIENTATIONS:
        for tolerance in TOLERANCES:
            part = [row for row in rows if (row["orientation"], row["tolerance"]) == (orientation, tolerance)]
            cells = []
            for row in part:
                lost = row["lost_ms"]
                firs = {name: lost[name] for name in names if name.startswith("fir ")}
                best = min(lost, key=lost.__getitem__)
                fir = min(firs, key=firs.__getitem__)
                cells.append(
                    [str(row["theta_deg"]), f"{best}: {lost[best]:.2f}", f"{fir}: {firs[fir]:.2f}"]
                    + [f"{lost[name]:.2f}" for name in shown]
                )
            text += f"\n{orientation}, tolerance {tolerance} mm\n\n"
            text += markdown(["turn [deg]", "fastest", "best of the fir c r", *shown], cells)
    loss = {name: [row["lost_ms"][name] - min(row["lost_ms"].values()) for row in rows] for name in names}
    order = sorted(names, key=lambda name: np.mean(loss[name]))
    text += "\nOver all corners: time lost beyond the fastest shape [ms], and at how many of them a shape is as good as it.\n\n"
    return text + markdown(
        ["shape", "mean", "worst", f"within {WITHIN} ms"],
        [
            [
                name,
                f"{np.mean(loss[name]):.2f}",
                f"{max(loss[name]):.2f}",
                f"{sum(x <= WITHIN for x in loss[name])} of {len(rows)}",
            ]
            for name in order
        ],
    )


def _figure(rows: list[dict[str, Any]]) -> None:
    """Time lost beyond the Bezier pair of method `optimal`, against the angle."""
    figure, axes = plt.subplots(len(ORIENTATIONS), len(TOLERANCES), figsize=(11, 7), sharex=True, sharey=True)
    for line, orientation in zip(axes, ORIENTATIONS, strict=True):
        for ax, tolerance in zip(line, TOLERANCES, strict=True):
            part = [row for row in rows if (row["orientation"], row["tolerance"]) == (orientation, tolerance)]
            for name in DRAWN:
                more = [row["lost_ms"][name] - row["lost_ms"]["bezier 0.94"] for row in part]
                ax.plot(ANGLES, more, ls="--" if name.startswith("fir ") else "-", lw=1.2, label=name)
            ax.set(title=f"{orientation}, {tolerance} mm", ylim=(-3, 8))
    axes[0][0].set_ylabel("lost beyond bezier 0.94 [ms]")
    axes[-1][0].set_xlabel("turning angle [deg]")
    axes[0][-1].legend(fontsize=7, ncol=3)
    figure.tight_layout()
    figure.savefig(RESULTS / "corner-shapes.png", dpi=80)


if __name__ == "__main__":
    main()
