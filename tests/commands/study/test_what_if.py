"""What if: settings and units, forecasts against closed forms and against plans made again, and the command."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from hand_made import SQUARE
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner, Result

from planner.base.errors import InputError
from planner.cli import app
from planner.commands.study.settings import (
    Setting,
    StudiedJob,
    parse_setting,
    setting_names,
    value_of,
    with_settings,
)
from planner.commands.study.what_if import forecast, what_if
from planner.machine import load_machine
from planner.nc.reader import parse_program
from planner.sensitivity.records import PriceList

MILL = load_machine("mill")


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["what-if", *(str(argument) for argument in arguments)])


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("axes.y.jerk=4e5", "axes.y.jerk", 4e5),
        ("y.jerk = 400 m/s3", "axes.y.jerk", 4e5),
        ("x.velocity=30 m/min", "axes.x.velocity", 500.0),
        ("x.velocity=60in/min", "axes.x.velocity", 25.4),
        ("z.acceleration=0.5g", "axes.z.acceleration", 4903.325),
        ("tolerance=20um", "tolerance", 0.02),
        ("tolerance=+50%", "tolerance", 0.03),
        ("tolerance=50%", "tolerance", 0.01),
        ("tolerance=-25%", "tolerance", 0.015),
        ("dt=4ms", "dt", 0.004),
        ("feed=120%", "feed", 1.2),
        ("feed_max=1.", "feed_max", 1.0),
    ],
)
def test_names_and_units(text: str, name: str, value: float) -> None:
    setting = parse_setting(text, MILL, 0.02)
    assert (setting.name, setting.value) == (name, pytest.approx(value, rel=1e-12))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("axes.y.jrek=4e5", "did you mean 'axes.y.jerk'?"),
        ("a.jerk=1", "there are axes.{x,y,z}"),
        ("tolerence=1", "did you mean 'tolerance'?"),
        ("fir.phase_lag_max=3", "cannot be set here"),  # the mill has no filters
        ("tools.1=20", "cannot be set here"),
        ("tolerance=thin", "write a number"),
        ("tolerance=20 m/s", "'m/s' is no unit of it"),
        ("x.jerk=4 m/s2", "did you mean 'm/s3'?"),
        ("tolerance=-0.02", "must be positive"),
        ("tolerance=-100%", "must be positive"),
        ("tolerance=1e999", "must be positive and finite"),
        ("feed_max=+10%", "a percentage of what?"),
        ("x.jerk=+50", "changes are in per cent, as +50%"),
        ("tolerance", "write a name and a value"),
    ],
)
def test_what_is_no_setting(text: str, said: str) -> None:
    with pytest.raises(InputError) as fault:
        parse_setting(text, MILL, 0.02)
    assert said in str(fault.value)


@pytest.mark.parametrize("name", setting_names(MILL))
def test_a_setting_changes_itself_alone(name: str) -> None:
    changed = with_settings(MILL, [Setting(name=name, value=0.125)])
    if name in ("tolerance", "feed"):
        assert changed == MILL
        return
    assert value_of(name, changed, 0.02) == 0.125
    others = set(setting_names(MILL)) - {name}
    assert all(value_of(each, changed, 0.02) == value_of(each, MILL, 0.02) for each in others)


# ------------------------------------------------------------------------------------------ forecasts


def price_list(price: float, saved: float, tolerance: float, saved_tolerance: float) -> PriceList:
    return PriceList(
        limits={"jerk.x": price},
        feed=0.0,
        tolerance=tolerance,
        saved={"jerk.x": saved, "tolerance": saved_tolerance},
        ranges={"jerk.x": (saved, saved), "tolerance": (saved_tolerance, saved_tolerance)},
        corners=None,
    )


@given(st.floats(1e-3, 10.0), st.floats(0.1, 10.0), st.floats(0.3, 1.0))
def test_a_forecast_agrees_with_the_prices_it_is_made_of(worth: float, ratio: float, flat: float) -> None:
    """At 10 % and 10 um more it is what the plan says; its slopes below are the prices; more never costs. Far away it goes with
    limit^-1/3, as lengths alone with jerk do."""
    jerk = MILL.axes["x"].jerk
    tenth = worth * (1.0 - 1.0 / 1.1) * flat
    prices = price_list(-worth / jerk, tenth, -worth, 0.01 * worth * flat)

    def of(name: str, value: float) -> float:
        found = forecast(prices, [Setting(name=name, value=value)], MILL, 0.02)
        assert found is not None
        assert found.least == found.most
        return found.least

    assert of("axes.x.jerk", 1.1 * jerk) == pytest.approx(-tenth, rel=1e-9)
    assert of("tolerance", 0.03) == pytest.approx(-0.01 * worth * flat, rel=1e-9)
    assert of("axes.x.jerk", jerk * (1 - 1e-6)) == pytest.approx(1e-6 * worth, rel=1e-4)
    assert of("tolerance", 0.02 - 1e-6) == pytest.approx(1e-6 * worth, rel=1e-4)
    assert of("axes.x.jerk", jerk / 8.0) == pytest.approx(3.0 * worth, rel=1e-9)
    assert (of("axes.x.jerk", ratio * jerk) > 0.0) == (ratio < 1.0) or ratio == 1.0
    assert (of("tolerance", ratio * 0.02) > 0.0) == (ratio < 1.0) or ratio == 1.0
    unknown = forecast(
        prices, [Setting(name="axes.x.jerk", value=1.0), Setting(name="dt", value=1.0)], MILL, 0.02
    )
    assert unknown is None
    assert forecast(None, [Setting(name="tolerance", value=1.0)], MILL, 0.02) is None
    assert forecast(prices, [Setting(name="tolerance", value=1.0)], MILL, math.nan) is None


@pytest.mark.shows("what-if", "sampled: forecasts beside plans made again")
@pytest.mark.slow
def test_forecasts_beside_plans_made_again() -> None:
    """On single corners a price is a number: within a fifth of what planning again saves, alone and together."""
    job = StudiedJob(
        program=parse_program(SQUARE, MILL), machine=MILL, how={"method": "optimal", "corner": "bezier"}
    )
    changes = [
        Setting(name="axes.x.jerk", value=1.2e5),
        Setting(name="axes.y.jerk", value=1.2e5),
        Setting(name="feed", value=1.1),
    ]
    labels: list[str] = []
    rows = what_if(job, changes, lambda label, stage, done: labels.append(label))
    assert [it.label for it in rows] == [
        "as it is", "axes.x.jerk=120000", "axes.y.jerk=120000", "feed=1.1", "all together"
    ]  # fmt: skip
    assert set(labels) == {it.label for it in rows}
    for it in rows[1:]:
        assert it.row.passed
        assert it.foretold is not None
        assert it.change is not None
        assert it.change < 0.0
        slack = 0.2 * abs(it.change)
        assert it.foretold.least - slack < it.change < it.foretold.most + slack


def test_the_command(tmp_path: Path) -> None:
    job = tmp_path / "square.ngc"
    job.write_text(SQUARE)
    done = run(job, "--set", "x.jerk=2e5", "--set", "dt=1e-9", "--method", "stop")
    assert done.exit_code == 3
    lines = [line.split() for line in done.stdout.splitlines()]
    assert lines[3][:4] == ["as", "it", "is", lines[3][3]]
    assert lines[4][:3] == ["axes.x.jerk=200000", "mm/s3", "100000"]
    assert lines[4][5] == "-"  # method stop has no prices
    assert [line[-1] for line in lines[3:7]] == ["passed", "passed", "refused", "refused"]
    assert "dt=1e-09: " in done.stdout
    said = json.loads(run(job, "--set", "x.jerk=2e5", "--method", "stop", "--json").stdout)["rows"]
    assert [row["change"] for row in said] == [{}, {"axes.x.jerk": 2e5}]
    assert said[1]["change_s"] == pytest.approx(said[1]["cycle_time_s"] - said[0]["cycle_time_s"])
    for wrong, told in (
        ([], "nothing to change"),
        (["--set", "feed=1.1", "--set", "feed=1.2"], "planner sweep"),
        (["--set", "feed=1.1", "--method", "stop", "--effort", "quick"], "method stop does not use it"),
        (["--set", "feed=1.1", "--tolerance", "0"], "no length above 0"),
    ):
        result = run(job, *wrong)
        assert (result.exit_code, told in result.stderr) == (2, True), result.stderr
