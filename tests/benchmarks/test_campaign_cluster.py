"""The campaign on the workers of a cluster, half of its jobs by the default, and the proved bound beside each motion."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.__main__ import main
from benchmarks.campaign import cluster, kept_rows
from benchmarks.campaign.jobs import HALF_DEFAULT_FROM, job
from benchmarks.campaign.rows import LAW_EVERY, outcome
from benchmarks.campaign.tally import Tally, wrongs
from planner.base.errors import InputError

ROW = {"source": "dense", "way": "stop", "outcome": "passed", "cpu": 0.02, "commit": "a"}


def test_half_of_the_later_jobs_have_the_default_method_and_effort() -> None:
    """Of all sources alike, of jobs that are held against a law too, and with the draws of earlier seeds as they were."""
    ways = {seed: job(seed).way for seed in range(HALF_DEFAULT_FROM, HALF_DEFAULT_FROM + 20)}
    default = [seed for seed, way in ways.items() if way == "optimal"]
    assert set(default) >= {seed for seed in ways if seed % 4 < 2}
    assert {seed % LAW_EVERY == 0 for seed in default} == {True, False}


def test_a_motion_below_its_bound_is_wrong() -> None:
    rows = [dict(ROW, seed=seed, above=above) for seed, above in ((5, 0.02), (6, 0.0))]
    tally = Tally()
    tally.add([*rows, dict(ROW, seed=7, above=-1e-6, below=-1e-6)])
    assert tally.above == {"stop": [0.02, 0.0, -1e-6]}
    assert list(tally.wrong) == [7]
    found = outcome(7)
    assert found["above"] >= 0.0
    assert not wrongs(found)


def test_an_address_without_a_scheduler_is_said(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "WAIT", 0.2)
    with pytest.raises(InputError, match="no scheduler answers there"):
        next(cluster.rows_on_cluster("tcp://127.0.0.1:9", [7], 1.0, 5.0))
    with pytest.raises(SystemExit):
        main(
            [
                "campaign",
                "--count",
                "1",
                "--file",
                str(tmp_path / "rows.jsonl"),
                "--cluster",
                "tcp://127.0.0.1:9",
            ]
        )
    assert "0 jobs are done, and the same command goes on" in capsys.readouterr().err


def test_a_worker_of_another_commit_plans_nothing() -> None:
    with pytest.raises(InputError, match="where the campaign has that of 0000000"):
        cluster.part([7], 5.0, "0000000")


@pytest.mark.slow
def test_a_cluster_plans_the_jobs_as_processes_here_do(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
    ) as made:
        file = tmp_path / "rows.jsonl"
        given = [
            "campaign",
            "--seed",
            "7",
            "--count",
            "2",
            "--file",
            str(file),
            "--cluster",
            made.scheduler_address,
        ]
        assert main(given) == 0
        there = {row["seed"]: row for row in kept_rows(file)}
        assert main(given) == 0
        assert len(kept_rows(file)) == 2  # it goes on behind them
    for seed, row in there.items():
        here = outcome(seed)
        assert (row["outcome"], row.get("time")) == (here["outcome"], here.get("time"))
