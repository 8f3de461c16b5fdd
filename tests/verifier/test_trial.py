"""The trial of benchmarks/judge/verifier_trial.py, on one plan: every kind of fault is proved and found, every correct motion
passes."""

import pytest

from benchmarks.judge.foreign import PROGRAMS
from benchmarks.judge.mutations import KINDS
from benchmarks.judge.verifier_trial import correct_of, faults_of


@pytest.mark.slow
def test_every_kind_of_fault_is_found():
    rows = faults_of(0, len(KINDS))
    assert {row["kind"] for row in rows} == {kind.__name__.replace("_", " ") for kind in KINDS}
    assert [row for row in rows if not row["found"]] == []


def test_correct_motions_from_files_pass():
    """Those of ruckig and TOPP-RA too."""
    pytest.importorskip("ruckig")
    pytest.importorskip("toppra")
    rows = correct_of(1)
    assert {row["motion"] for row in rows} == {"closed form", "kinematic", "stop", *PROGRAMS}
    assert [row for row in rows if row["answer"] != "passed"] == []
