"""Pictures of a suite: performance profiles, motion against planning time, how planning grows, and accuracy against the grid."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.runner import grid_report
from benchmarks.runner.figures_of_merit import growth, ratios, trades
from benchmarks.runner.rows import Row

NEAREST, WIDEST = 1e-5, 10.0  # between which profiles are drawn, over the best, less 1 [-]
FAR = 3.0  # cycle time over the best from which trades have a logarithmic axis [-]
LABELS = ((4, 4), (4, -10))  # where names stand beside their points, in turns [points]
SIZE, DPI = (7.0, 4.5), 110
PLAIN = {"Software": None}  # no version of the library in the file: the same picture gives the same bytes


def draw(folder: Path, suite: str, jobs: dict[str, dict[str, Row]], *, scales: bool) -> list[Path]:
    """Draw what the rows give pictures of; returns the files."""
    made = []
    if shares := ratios(jobs):
        made.append(_drawn(folder / f"suite-{suite}-profile.png", lambda axes: _profile(axes, shares)))
    if len(trades(jobs)) > 1:
        made.append(_drawn(folder / f"suite-{suite}-trade.png", lambda axes: _trade(axes, jobs)))
    if scales and growth(jobs):
        made.append(_drawn(folder / f"suite-{suite}-growth.png", lambda axes: _growth(axes, jobs)))
    if grid_report.converging(jobs, False):
        made.append(_drawn(folder / f"suite-{suite}-order.png", lambda axes: grid_report.draw_on(axes, jobs)))
    return made


def _drawn(file: Path, draw_on) -> Path:
    with matplotlib.rc_context({"font.size": 9}):
        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        axes = figure.subplots()
        draw_on(axes)
        axes.grid(alpha=0.3)
        figure.savefig(file, metadata=PLAIN)
    return file


def _profile(axes: Axes, shares: dict[str, np.ndarray]) -> None:
    for number, (way, of_way) in enumerate(shares.items()):
        reached = of_way[np.isfinite(of_way)] - 1.0
        share = np.arange(1, len(reached) + 1) / len(of_way)
        more = np.concatenate([[0.5 * NEAREST], np.clip(reached, NEAREST, WIDEST), [WIDEST]])
        axes.step(
            more, 100.0 * np.concatenate([[0.0], share, share[-1:]]), where="post", label=way,
            ls=("-", "--", ":")[number // 10 % 3], color=f"C{number % 10}",
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set(
        xlim=(0.5 * NEAREST, WIDEST),
        ylim=(0.0, 102.0),
        xlabel="cycle time over the best of the job, less 1",
        ylabel="share of the jobs [%]",
    )
    axes.legend(fontsize=7, loc="best")


def _trade(axes: Axes, jobs: dict[str, dict[str, Row]]) -> None:
    found = sorted(trades(jobs), key=lambda one: one.cpu)
    front = sorted((one.cpu, one.cycle) for one in found if one.front)
    axes.step(*zip(*front, strict=True), where="post", color="0.7", lw=1.0)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    if max(one.cycle for one in found) > FAR:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(NullFormatter())
    for number, one in enumerate(found):
        axes.plot(one.cpu, one.cycle, "o", mfc="none" if one.free else None, color="C1" if one.free else "C0")
        axes.annotate(
            f"{one.way} ({one.jobs})",
            (one.cpu, one.cycle),
            LABELS[number % len(LABELS)],
            textcoords="offset points",
            fontsize=7,
        )
    axes.set(
        xlabel="processor time over that of optimal, geometric mean",
        ylabel="cycle time over the best, geometric mean", title="in brackets: jobs; hollow: without a jerk limit",
    )  # fmt: skip


def _growth(axes: Axes, jobs: dict[str, dict[str, Row]]) -> None:
    for way, (sizes, seconds, slope) in growth(jobs).items():
        axes.loglog(sizes, seconds, "o-", ms=3, label=f"{way}, slope {slope:.2f}")
    axes.set(xlabel="blocks", ylabel="processor time [s]")
    axes.legend(fontsize=7)
