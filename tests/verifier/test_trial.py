"""The trial of benchmarks/judge/verifier_trial.py, on few plans: every kind of fault is proved and found, every correct motion
passes."""

import pytest

from benchmarks.judge.foreign import PROGRAMS
from benchmarks.judge.mutations import KINDS
from benchmarks.judge.verifier_trial import CLOCKS, WRONG, correct_of, faults_of, jittering_of, wrong_of


@pytest.mark.shows("verify", "sampled: twenty kinds of proved faults at random places")
@pytest.mark.slow
def test_every_kind_of_fault_is_found():
    rows = faults_of(0, len(KINDS))
    assert {row["kind"] for row in rows} == {kind.__name__.replace("_", " ") for kind in KINDS}
    assert [row for row in rows if not row["found"]] == []


@pytest.mark.shows("verify", "sampled: twenty kinds of proved faults at random places")
@pytest.mark.parametrize("which", range(len(WRONG)), ids=lambda which: WRONG[which].__name__)
def test_a_motion_of_another_program_is_refused_and_passes_by_its_own(which):
    rows = wrong_of(which, 2)
    assert [row["found"] for row in rows] == [True, True]
    assert not any(row["own"] for row in rows)


@pytest.mark.shows("verify", "sampled: twenty kinds of proved faults at random places")
def test_correct_motions_from_files_pass():
    """Those of ruckig and TOPP-RA too."""
    pytest.importorskip("ruckig")
    pytest.importorskip("toppra")
    rows = correct_of(1)
    assert {row["motion"] for row in rows} == {"closed form", "kinematic", "stop", *PROGRAMS}
    assert [row for row in rows if row["answer"] != "passed"] == []


@pytest.mark.shows("verify", "sampled: twenty kinds of proved faults at random places")
def test_correct_motions_of_clocks_that_jitter_pass():
    pytest.importorskip("ruckig")
    pytest.importorskip("toppra")
    rows = jittering_of(1)
    assert len(rows) == len(CLOCKS) * (1 + len(PROGRAMS))
    assert [row for row in rows if row["answer"] != "passed"] == []
