"""A motion read by several threads: what is found is the same to the last bit, and an error or an interrupt ends the reading."""

import dataclasses
import threading
from collections.abc import Mapping

import numpy as np
import pytest
from judging import SQUARE, M, judge, square
from motions import Asked, polyline, sample

from planner.base.threads import use_threads
from planner.verifier import feed, limits, reading, samples, stream, verify

pytestmark = pytest.mark.usefixtures("threads_as_before")


@pytest.fixture
def in_parts(monkeypatch):
    """Many parts, of several blocks each, in as many threads as there may be."""
    monkeypatch.setattr(reading, "SIDE_BY_SIDE", 0)
    monkeypatch.setattr(reading, "CELLS", 500)
    monkeypatch.setattr(stream, "BLOCK_SAMPLES", 170)


def told(value):
    """All that is in a value, to the last bit."""
    if dataclasses.is_dataclass(value):
        return [(one.name, told(getattr(value, one.name))) for one in dataclasses.fields(value)]
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if isinstance(value, Mapping):
        return [(key, told(one)) for key, one in value.items()]
    if isinstance(value, (tuple, list)):
        return [told(one) for one in value]
    return value.hex() if isinstance(value, float) else repr(value)


@pytest.mark.parametrize(("speed", "passes"), [(50.0, True), (70.0, False)])
def test_a_verdict_is_the_same_on_any_number_of_threads(in_parts, speed, passes):
    found = []
    for count in (1, 2, 5):
        use_threads(count)
        found.append(judge(polyline(SQUARE, speed, jerk=2e5), square()))
    assert found[0].passed == passes
    assert bool(found[0].excesses) != passes
    assert told(found[1]) == told(found[2]) == told(found[0])


def test_a_part_is_judged_while_the_next_is_found_on_the_path(in_parts, monkeypatch):
    """Each waits for the other, which has to be of another part."""
    use_threads(2)
    meet, located, judged = threading.Barrier(2), [], []
    whole = {name: getattr(stream.Watch, name) for name in ("judge", "locate")}

    def between(watch):
        return watch.seen.note != ""

    def locate(self, chunk):
        if between(self):
            located.append(chunk)
            meet.wait(timeout=60.0)
        yield from whole["locate"](self, chunk)

    def judge(self, blocks):
        if between(self):
            judged.append(len(blocks))
            if len(judged) <= len(expected):
                meet.wait(timeout=60.0)
        whole["judge"](self, blocks)

    motion = polyline(SQUARE, 50.0, jerk=2e5)
    asked = Asked(motion, M.dt)
    expected = list(reading.motion_between(asked, M.dt, 0, reading.PER_PERIOD))
    monkeypatch.setattr(stream.Watch, "locate", locate)
    monkeypatch.setattr(stream.Watch, "judge", judge)
    assert verify(sample(motion, M.dt), square(), M, motion=asked).passed
    assert len(located) == len(expected) > 3
    assert judged[0] == 0
    assert all(judged[1:])


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize(
    ("where", "name", "after"),
    [
        (Asked, "at", 3),
        (stream, "match_samples", 9),
        (stream, "look_between", 5),
        (limits, "_look", 5),
        (feed.Feeds, "take", 5),
        (samples.Delivered, "take", 0),
        (reading.Comparison, "compare", 2),
    ],
)
def test_an_error_in_any_stage_ends_the_reading_with_it(in_parts, monkeypatch, count, where, name, after):
    use_threads(count)
    whole, calls = getattr(where, name), []
    motion = polyline(SQUARE, 50.0, jerk=2e5)
    delivered = sample(motion, M.dt)

    def fails(*given, **named):
        calls.append(threading.get_ident())
        if len(calls) > after:
            raise OSError("broken")
        return whole(*given, **named)

    monkeypatch.setattr(where, name, fails)
    before = threading.active_count()
    with pytest.raises(OSError, match="broken"):
        verify(delivered, square(), M, motion=Asked(motion, M.dt))
    assert after < len(calls) <= after + 2
    assert threading.active_count() == before


@pytest.mark.parametrize("count", [1, 2])
def test_progress_is_told_in_the_thread_that_asked_and_may_end_it(in_parts, count):
    use_threads(count)
    heard = []

    def progress(done):
        heard.append((done, threading.get_ident()))
        if stop and done > 0.4:
            raise KeyboardInterrupt

    motion = polyline(SQUARE, 50.0, jerk=2e5)
    stop = False
    judge(motion, square(), progress=progress)
    done, by = zip(*heard, strict=True)
    assert list(done) == sorted(done)
    assert len(done) > 5
    assert set(by) == {threading.get_ident()}
    stop = True
    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt):
        judge(motion, square(), progress=progress)
    assert heard[-1][0] < 0.9
    assert threading.active_count() == before
