"""The sizes at which the code changes its way: each has a small value, and with it the same plan comes out as with the usual one."""

from __future__ import annotations

import ast
import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from planner.base import sizes
from planner.base.errors import InputError
from planner.base.sizes import KINDS, SMALL, USUAL, chosen

ROOT = Path(__file__).resolve().parents[2]
# What other windows leave of the time [-]: a hundredth of what a grid does. Splines without a search after them differ by what their
# windows do (planner/base/sizes.py).
ANOTHER_ROUTE, OTHER_SPLINES = 1e-4, 2e-3
SPLINES_ALONE = {"second-order"}
NOT_FROM_A_FILE = {"fir", "fir-spline"}
LESS_EFFORT = 0.032  # chords that are not searched but planned along splines: 3.0 %


def test_a_kind_makes_its_own_sizes_small_and_no_others():
    assert chosen("") == USUAL
    for kind in KINDS:
        of_kind = {size.name for size in dataclasses.fields(USUAL) if size.metadata["kind"] == kind}
        changed = {name for name, value in vars(chosen(kind)).items() if value != getattr(USUAL, name)}
        assert changed <= of_kind
        assert changed
    assert chosen(SMALL) == chosen(",".join(KINDS)) != chosen("parts, routes")


@pytest.mark.parametrize("said", ["large", "parts,big", "Small"])
def test_another_word_is_named(said):
    with pytest.raises(InputError, match="no kind of sizes is called"):
        chosen(said)


def test_every_size_is_used_and_small_is_less():
    """A size that nothing reads any more would be tried in vain."""
    used = set()
    for file in (ROOT / "planner").rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "SIZES" in text else ():
            if (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id == "SIZES"
            ):
                used.add(node.attr)
    assert used == set(vars(USUAL))
    small = vars(chosen(SMALL))
    assert not [name for name, usual in vars(USUAL).items() if not np.all(np.less_equal(small[name], usual))]


def test_small_sizes_go_together():
    """Windows are longer than what two of them share; windows of a search are at least twice as long as what is searched once more
    around their joins, or two threads would work on the same steps."""
    for found in (USUAL, chosen(SMALL)):
        assert found.relaxed_window > 2 * found.relaxed_overlap
        assert found.searched_whole / (found.searched_whole // found.searched_window + 1) > 2 * (
            found.searched_overlap + found.searched_join
        )
        assert found.searched_join < found.searched_overlap


def planned(folder: Path, kinds: str) -> Path:
    """The jobs of both_ways.py, planned with small sizes of these kinds."""
    made = subprocess.run(
        [sys.executable, "-W", "error", "-m", "tests.both_ways", folder],
        cwd=ROOT,
        env=os.environ | {sizes.VARIABLE: kinds, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr[-2000:]
    return folder


@pytest.fixture(scope="module")
def usual(tmp_path_factory) -> Path:
    return planned(tmp_path_factory.mktemp("usual"), "")


def verdicts(folder: Path) -> dict[str, dict]:
    return {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in sorted(folder.glob("*.json"))}


@pytest.mark.shows("large", "sampled: the same plans with small sizes")
@pytest.mark.slow
def test_in_parts_setpoints_and_verdicts_are_the_same(usual, tmp_path):
    """To rounding: one of the jobs is two straight moves in one direction, which long motions once could not be judged on."""
    parts = planned(tmp_path, "parts,shown")
    before, after = verdicts(usual), verdicts(parts)
    assert len(before) >= 12
    assert list(before) == list(after)
    for name, wanted in before.items():
        found = after[name]
        assert (wanted["kind"], found["kind"]) == ("Trajectory", "TrajectoryOnDemand")
        assert found["passed"] == wanted["passed"]
        assert found["corners"] == wanted["corners"]
        assert found["ratios"] == pytest.approx(wanted["ratios"], rel=1e-8, abs=1e-9)
        kept, asked = (np.load(folder / f"{name}.npz") for folder in (usual, parts))
        for column in kept.files:
            scale = np.abs(kept[column]).max() or 1.0
            np.testing.assert_allclose(asked[column], kept[column], rtol=0, atol=1e-8 * scale, err_msg=name)
        texts = [sorted(folder.glob(f"{name}/planned.ngc")) for folder in (usual, parts)]
        assert len(texts[0]) == len(texts[1]) == (name not in NOT_FROM_A_FILE)
        for one, other in zip(*texts, strict=True):
            assert one.read_bytes() == other.read_bytes()


@pytest.mark.shows("large", "sampled: the same plans with small sizes")
@pytest.mark.slow
def test_on_other_routes_the_same_optimum_is_found(usual, tmp_path):
    before, after = verdicts(usual), verdicts(planned(tmp_path, "routes"))
    for name, wanted in before.items():
        rel = OTHER_SPLINES if name in SPLINES_ALONE else ANOTHER_ROUTE
        assert after[name]["passed"] == wanted["passed"], name
        assert after[name]["time"] == pytest.approx(wanted["time"], rel=rel), name


@pytest.mark.slow
def test_with_all_sizes_small_every_verdict_is_the_same(usual, tmp_path):
    before, after = verdicts(usual), verdicts(planned(tmp_path, SMALL))
    for name, wanted in before.items():
        assert after[name]["passed"] == wanted["passed"], name
        assert (1 - ANOTHER_ROUTE) * wanted["time"] < after[name]["time"] < (1 + LESS_EFFORT) * wanted["time"]
