"""Mutations: every kind of fault put into a correct motion is found, and named with its line."""

import numpy as np
import pytest
from judging import COLUMNS, SQUARE, M, fault, full_circle, judge, square
from motions import (
    JERK_FREE,
    Asked,
    Moves,
    along,
    chain,
    changed,
    machine,
    polyline,
    rest_to_rest,
    rounded,
    sample,
    straight,
)

from planner.base.errors import InputError
from planner.verifier import Kind, verify

# ---- limits ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tightened", "name", "ratio"),
    [
        ({"velocity": 49.0}, "velocity.y", 50 / 49),
        ({"acceleration": 1990.0}, "acceleration.x", 2000 / 1990),
        ({"jerk": 1.99e5}, "jerk.x", 2e5 / 1.99e5),
    ],
)
def test_an_axis_limit_broken_by_a_little_is_found(tightened, name, ratio):
    tight = machine(**tightened)
    motion = polyline(SQUARE, jerk=2e5)
    verdict = judge(motion, square(), tight)
    assert verdict.limits[name].ratio == pytest.approx(ratio, rel=1e-4)
    assert "line" in fault(verdict, name)
    for other in ("column", "end", "start", "vertex", "contour", "order", "dwell"):
        assert not any(text.startswith(other) for text in verdict.sentences)


def test_the_positions_convict_where_the_columns_are_silent():
    toolpath = square()
    trajectory = sample(polyline(SQUARE, jerk=2e5), M.dt)
    tight = machine(velocity=40.0)
    silent = changed(trajectory, velocity=np.clip(trajectory.velocity, -40, 40))
    check = verify(silent, toolpath, tight).limits["velocity.x"]
    assert check.ratio == pytest.approx(50 / 40, rel=1e-6)
    assert check.note == "differences of position"


def test_one_axis_too_fast_is_named_with_its_line():
    toolpath = square(feed=200)
    legs = [polyline(SQUARE[k : k + 2], feed=(50, 104, 50, 50)[k], acceleration=1900) for k in range(4)]
    verdict = judge(chain(*legs), toolpath, not_limited=JERK_FREE)
    assert "line 20" in fault(verdict, "velocity.y")
    assert verdict.limits["velocity.y"].ratio == pytest.approx(1.04, abs=1e-9)
    (found,) = verdict.faults
    assert (found.kind, found.name, found.line) == (Kind.LIMIT, "velocity.y", 20)
    assert found.ratio == pytest.approx(1.04, abs=1e-9)
    assert found.time is not None
    assert f"{found.name}: " in str(found)
    assert verdict.kinds == {Kind.LIMIT}


def test_acceleration_between_the_samples_is_seen_in_the_asked_motion_only():
    """A ripple of period dt vanishes on every sample: 3000 mm/s2 of it at 1 kHz is 0.08 um."""
    toolpath = square()
    duration, base = polyline(SQUARE, acceleration=1000, jerk=1e5)
    omega = 2 * np.pi / M.dt

    def rippled(t):
        r, v, a, j = (each.copy() for each in base(t))
        on = (t > 0.1) & (t < 0.102)
        size = 3000 / omega**2
        r[on, 0] += size * (1 - np.cos(omega * t[on]))
        v[on, 0] += size * omega * np.sin(omega * t[on])
        a[on, 0] += size * omega**2 * np.cos(omega * t[on])
        return r, v, a, j

    trajectory = sample((duration, base), M.dt)
    assert verify(trajectory, toolpath, M).passed
    asked = Asked((duration, rippled), M.dt, fine=8)
    verdict = verify(trajectory, toolpath, M, motion=asked, not_limited=JERK_FREE)
    text = fault(verdict, "acceleration.x")
    assert "between the samples" in text
    assert "line 10" in text
    assert verdict.limits["acceleration.x"].value == pytest.approx(3000, rel=0.01)


def test_feed_above_the_programmed_one_is_named_with_its_line():
    toolpath = Moves().line(10, feed=50).line(20, feed=30).line(30, feed=50).toolpath(M)
    verdict = judge(polyline([(0, 0, 0), (30, 0, 0)], feed=50), toolpath, not_limited=JERK_FREE)
    check = verdict.limits["feed"]
    assert check.ratio == pytest.approx(50 / 30, rel=1e-9)
    assert check.line == 20
    # the feed of line 10 holds as far as the joint, whatever the tolerance
    assert 10 <= check.position[0] <= 10 + 2 * 50 * M.dt
    assert "line 20" in fault(verdict, "feed")


def test_feed_does_not_count_on_rapids():
    toolpath = Moves().rapid(30).toolpath(M)
    verdict = judge(polyline([(0, 0, 0), (30, 0, 0)], feed=100), toolpath, not_limited=JERK_FREE)
    assert verdict.passed, verdict.faults
    assert verdict.limits["feed"].ratio == 0.0


def test_normal_acceleration_beyond_its_limit_is_found():
    limited = machine(normal_acceleration=240.0)
    toolpath = Moves((10.0, 0, 0)).arc((0, 0), 2 * np.pi).toolpath(limited)
    verdict = judge(full_circle(), toolpath, limited)
    assert verdict.limits["normal_acceleration"].ratio == pytest.approx(250 / 240, rel=1e-5)
    fault(verdict, "normal_acceleration")
    assert judge(full_circle(), toolpath, limited, not_limited=("normal_acceleration",)).passed


def test_a_quantity_not_limited_is_reported_and_does_not_fail():
    motion = polyline(SQUARE)
    assert not judge(motion, square()).passed
    verdict = judge(motion, square(), not_limited=JERK_FREE)
    assert verdict.passed
    assert verdict.limits["jerk.x"].ratio > 10


# ---- columns and samples ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("column", "factor"), [("velocity", 0.99), ("acceleration", 0.9)])
def test_lying_columns_are_found(column, factor):
    trajectory = sample(polyline(SQUARE, jerk=2e5), M.dt)
    lying = changed(trajectory, **{column: factor * getattr(trajectory, column)})
    text = fault(verify(lying, square(), M), "columns")
    assert f"{column}.x" in text
    assert "line 10" in text or "line 30" in text  # both run along x alike


def test_columns_of_zeros_are_found_without_a_jerk_limit():
    trajectory = sample(polyline(SQUARE), M.dt)
    lying = changed(trajectory, velocity=0 * trajectory.velocity)
    fault(verify(lying, square(), M, not_limited=JERK_FREE), "columns: velocity.x")


def test_a_period_that_is_not_dt_is_found():
    trajectory = sample(polyline(SQUARE, jerk=2e5), M.dt)
    keep = np.delete(np.arange(len(trajectory)), 57)
    gap = changed(trajectory, **{name: getattr(trajectory, name)[keep] for name in COLUMNS})
    assert "0.056 s" in fault(verify(gap, square(), M), "period")


def test_a_motion_that_is_another_one_than_the_samples_is_found():
    trajectory = sample(polyline(SQUARE, jerk=2e5), M.dt)
    verdict = verify(trajectory, square(), M, motion=Asked(polyline(SQUARE, jerk=1.9e5), M.dt))
    fault(verdict, "motion: not the delivered one")


def test_a_motion_that_ends_before_or_after_its_samples_is_found():
    motion = polyline(SQUARE, jerk=2e5)
    whole, half = sample(motion, M.dt), (0.5 * motion[0], motion[1])
    fault(verify(whole, square(), M, motion=Asked(half, M.dt)), "motion: it lasts")
    cut = changed(whole, **{name: getattr(whole, name)[:-1] for name in COLUMNS})
    fault(verify(cut, square(), M, motion=Asked(motion, M.dt)), "motion: it lasts")


# ---- contour ---------------------------------------------------------------------------------------------------------


def test_a_contour_error_of_101_percent_is_found():
    toolpath = Moves().line(20).toolpath(M)
    duration, base = polyline([(0, 0, 0), (20, 0, 0)], feed=20, jerk=2e5)

    def bulging(t, size):
        r, v, a, j = (each.copy() for each in base(t))
        x = r[:, 0] * np.pi / 20
        r[:, 1] = size * np.sin(x) ** 2
        v[:, 1] = size * np.sin(2 * x) * np.pi / 20 * v[:, 0]
        c, s = np.cos(2 * x), np.sin(2 * x)
        k = np.pi / 20
        a[:, 1] = size * (2 * c * k**2 * v[:, 0] ** 2 + s * k * a[:, 0])
        j[:, 1] = size * k * (s * j[:, 0] + 6 * c * k * v[:, 0] * a[:, 0] - 4 * s * k**2 * v[:, 0] ** 3)
        return r, v, a, j

    fits = judge((duration, lambda t: bulging(t, 0.05)), toolpath)
    assert [f for f in fits.sentences if not f.startswith("feed")] == []
    assert fits.contour_error_mm == pytest.approx(0.05, abs=1e-6)
    verdict = judge((duration, lambda t: bulging(t, 0.0505)), toolpath)
    assert verdict.contour_error_mm == pytest.approx(0.0505, abs=1e-6)
    assert "line 10" in fault(verdict, "contour")
    assert Kind.ORDER not in verdict.kinds


@pytest.mark.parametrize("angle", [20.0, 60.0, 90.0, 135.0])
def test_a_corner_cut_too_deep_by_one_percent_is_found(angle):
    turn = np.deg2rad(angle)
    points = [(0.0, 0, 0), (10.0, 0, 0), (10 + 10 * np.cos(turn), 10 * np.sin(turn), 0)]
    fast = machine(acceleration=1e5, jerk=1e9)
    toolpath = Moves().line(*points[1]).line(*points[2]).toolpath(fast)
    verdict = judge(rounded(points, 0.0505, 2.0), toolpath, fast, not_limited=JERK_FREE)
    assert verdict.vertex_error_mm == pytest.approx(0.0505, rel=1e-3)
    assert "line 10" in fault(verdict, "vertex")
    # only the vertex is missed: every point of the motion itself is near the path, and no block is left out
    assert verdict.contour_error_mm <= 0.05
    assert Kind.ORDER not in verdict.kinds


def test_each_joint_has_its_own_budget():
    toolpath = square()
    tight = changed_tolerance(toolpath, [0.05, 0.001, 0.05, 0.05, 0.05])
    length, curve = straight((0, 0, 0), (10 - 0.002, 0, 0))
    legs = [
        along(length, curve, rest_to_rest(length, 50, 2000, 2e5)),
        polyline([(10 - 0.002, 0, 0), *SQUARE[2:]], jerk=2e5),
    ]
    assert "line 10" in fault(judge(chain(*legs), tight), "vertex")
    assert judge(chain(*legs), toolpath).vertex_error_mm == pytest.approx(0.002, rel=0.01)


def changed_tolerance(toolpath, tolerance):
    fields = {name: getattr(toolpath, name) for name in toolpath.__dataclass_fields__}
    return type(toolpath)(**{**fields, "tolerance": np.array(tolerance)})


# ---- input -----------------------------------------------------------------------------------------------------------


def test_bad_input_is_refused():
    trajectory, toolpath = sample(polyline(SQUARE), M.dt), square()
    with pytest.raises(ValueError, match="not_limited: 'jerks' is not known"):
        verify(trajectory, toolpath, M, not_limited=("jerks",))
    with pytest.raises(InputError, match="axes x y a, the program x y z"):
        verify(changed(trajectory, axes=("x", "y", "a")), toolpath, M)
    with pytest.raises(InputError, match="no samples"):
        verify(changed(trajectory, **{name: getattr(trajectory, name)[:0] for name in COLUMNS}), toolpath, M)


def test_a_toolpath_that_contradicts_itself_is_refused():
    toolpath = square()
    fields = {name: getattr(toolpath, name) for name in toolpath.__dataclass_fields__}
    moved = toolpath.start.copy()
    moved[2] += 0.001
    broken = type(toolpath)(**{**fields, "start": moved})
    with pytest.raises(ValueError, match=r"segment 2 \(line 30\) does not start where the one before ends"):
        verify(sample(polyline(SQUARE), M.dt), broken, M)


@pytest.mark.parametrize("speed", [0.2, 0.8])
def test_a_stop_run_through_slowly_is_no_rest_where_jerk_is_limited(speed):
    # a period of 1 ms shows of a rest at most j h^3/6 = 0.033 um of 2e5 mm/s3, which is 0.033 mm/s; a h/2 is 1 mm/s of 2000 mm/s2
    toolpath = Moves().line(0.5, feed=speed).dwell(1e-4).line(1, feed=speed).toolpath(M)
    verdict = judge(polyline([(0, 0, 0), (1, 0, 0)], feed=speed, jerk=2e5), toolpath)
    assert "no full stop" in fault(verdict, "stop")
    rests = chain(*(polyline([(a, 0, 0), (a + 0.5, 0, 0)], feed=speed, jerk=2e5) for a in (0.0, 0.5)))
    verdict = judge(rests, toolpath)
    assert not [text for text in verdict.sentences if text.startswith("stop")], verdict.sentences
