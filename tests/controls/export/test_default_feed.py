"""A program without an F word is run at the machine's default feed, and what is exported of it says that feed."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from tests.controls.export.test_exports_keep import MACHINE, exported


@pytest.mark.parametrize("kind", ["own", "chords"])
@pytest.mark.parametrize(
    "text", ["G21 G90\nG1 X10 Y5\nX20\nM2\n", "G20 G90\nG1 X1 Y0.5\nX2\nM2\n"], ids=["mm", "inch"]
)
def test_the_default_feed_is_written_in_the_unit_of_the_program(text: str, kind: str) -> None:
    bare = MACHINE.model_copy(update={"feed_default": None})  # which refuses moves without F
    again = planner.read_program(text="\n".join(exported(text, "grbl", kind)), machine=bare)
    assert MACHINE.feed_default is not None
    np.testing.assert_allclose(again.feed, MACHINE.feed_default, rtol=2e-4)  # digits of an F word
