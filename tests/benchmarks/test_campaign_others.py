"""Jobs of the campaign as other people's programs are."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest

from benchmarks.campaign.jobs import HALF_DEFAULT_FROM, OTHERS_FROM, Job, job, job_from
from benchmarks.campaign.others import KINDS, PERIODS
from planner.machine.parts import MAGNITUDE_MAX

FIRST = range(OTHERS_FROM, OTHERS_FROM + 160)


@pytest.fixture(scope="module")
def jobs() -> list[Job]:
    return [job(seed) for seed in FIRST]


def test_every_kind_is_drawn_and_all_but_the_tiniest_arcs_can_be_read(jobs: list[Job]) -> None:
    sources = defaultdict(list)
    for made in jobs:
        sources[made.source].append(made)
    assert sources.keys() == KINDS.keys()
    assert all(made.program is not None or "the arc" in made.refusal for made in jobs)
    assert all((made.machine.normal_acceleration or 0.0) <= MAGNITUDE_MAX for made in jobs)
    refused = sum(made.program is None for made in jobs)
    assert refused <= len(jobs) // 20


def test_programs_have_what_their_kind_is_named_for(jobs: list[Job]) -> None:
    of = defaultdict(list)
    for made in jobs:
        if made.program is not None:
            of[made.source.removeprefix("others: ")].append(made.program)
    assert all(len(program.arc_block) for kind in ("pocket", "trochoid", "helix") for program in of[kind])
    assert any(np.ptp(program.end[:, 3]) > np.pi for program in of["fourth axis"])  # [rad]
    assert all(len(program) <= 40 for some in of.values() for program in some)
    far = [abs(program.start).max() for some in of.values() for program in some if len(program)]
    assert max(np.abs(program.end).max() for some in of.values() for program in some) > 1e4 > np.median(far)


def test_machines_keep_their_periods_and_three_of_ten_have_filters(jobs: list[Job]) -> None:
    assert {made.machine.dt for made in jobs} == set(PERIODS)
    filters = [made.machine.fir.time_constants for made in jobs if made.machine.fir is not None]
    assert 0.15 < len(filters) / len(jobs) < 0.45
    assert max(map(max, filters)) <= 0.06
    ratios = [
        max(axis.velocity for axis in made.machine.axes.values())
        / min(axis.velocity for axis in made.machine.axes.values())
        for made in jobs
    ]
    assert np.median(ratios) > 2.0
    assert sum("G20" in made.text for made in jobs) > len(jobs) // 8


def test_half_have_the_default_and_a_job_is_read_again(jobs: list[Job]) -> None:
    assert sum(made.way == "optimal" for made in jobs) >= len(jobs) // 2
    made = next(made for made in jobs if made.program is not None)
    again = job_from(made.data())
    assert again.program is not None
    assert made.program is not None
    assert again.machine == made.machine
    np.testing.assert_array_equal(again.program.end, made.program.end)


def test_earlier_seeds_draw_what_they_drew() -> None:
    assert not {job(seed).source for seed in range(HALF_DEFAULT_FROM, HALF_DEFAULT_FROM + 30)} & KINDS.keys()
