"""What if: a job as it is, with each of some settings changed alone, and with all of them, planned again; beside what the prices of the
first plan foretold (commands/study/forecast.py)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from planner.base.errors import InputError, NotSolvedError
from planner.commands.study.forecast import Forecast, forecast
from planner.commands.study.settings import Setting
from planner.commands.study.variant import StudiedJob
from planner.report.compare import Row, refused, row_of_plan

AS_PLANNED, TOGETHER = "as it is", "all together"


@dataclass(frozen=True, kw_only=True)
class WhatIf:
    """One row: a change, and what came of it.

    label    : the change in words
    settings : the changed settings, none for the job as it is
    row      : how the plan ended (report/compare.py)
    change   : of the cycle time against the job as it is [s]; None without a motion
    foretold : the same by prices; None where there are none
    """

    label: str
    settings: tuple[Setting, ...]
    row: Row
    change: float | None
    foretold: Forecast | None


def what_if(
    job: StudiedJob,
    settings: Sequence[Setting],
    progress: Callable[[str, str, float], None] | None = None,
) -> list[WhatIf]:
    """Plan a job as it is, with each setting alone, and with all of them if there is more than one.

    progress : called with the label of the row, the stage and the fraction of it that is done

    Raises InputError if a setting is there twice, and for a job that cannot be planned as it is; NotSolvedError if it has no motion.
    What cannot be planned with another setting is its row.
    """
    names = [setting.name for setting in settings]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name} is set twice; `planner sweep` plans with several values of one setting")
    choices = [(AS_PLANNED, ()), *((str(setting), (setting,)) for setting in settings)]
    if len(settings) > 1:
        choices.append((TOGETHER, tuple(settings)))
    changed = [(label, chosen, job.changed(chosen)) for label, chosen in choices]
    rows: list[WhatIf] = []
    time, prices = None, None
    for label, chosen, variant in changed:
        try:
            plan = variant.plan(None if progress is None else _named(progress, label))
            row = row_of_plan(label, plan)
        except (InputError, NotSolvedError) as fault:
            if not chosen:
                raise
            row = refused(label, fault)
        if not chosen:
            plan.require()
            time, prices = row.cycle_time, plan.prices
        assert time is not None
        rows.append(
            WhatIf(
                label=label,
                settings=chosen,
                row=row,
                change=None if row.cycle_time is None else row.cycle_time - time,
                foretold=forecast(prices, chosen, job.machine, job.present_tolerance) if chosen else None,
            )
        )
    return rows


def _named(progress: Callable[[str, str, float], None], label: str) -> Callable[[str, float], None]:
    return lambda stage, fraction: progress(label, stage, fraction)
