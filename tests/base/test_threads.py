"""Work side by side: all of it is done, an error of any ends the rest, and the number of threads is what was asked for."""

from __future__ import annotations

import threading

import pytest

from planner.base.threads import side_by_side, threads, use_threads

pytestmark = pytest.mark.usefixtures("threads_as_before")


def test_one_per_core_unless_said():
    assert threads() >= 1
    use_threads(3)
    assert threads() == 3
    with pytest.raises(ValueError, match="0 threads"):
        use_threads(0)


def test_all_work_is_done_and_the_caller_is_told_meanwhile():
    use_threads(2)
    done, told, here = [], [], threading.get_ident()
    side_by_side(
        [lambda k=k: done.append(k) for k in range(20)],
        lambda: pytest.fail("nothing to stop"),
        lambda: told.append(threading.get_ident()),
    )
    assert sorted(done) == list(range(20))
    assert set(told) == {here}


def test_an_error_stops_the_rest_and_is_raised():
    use_threads(2)
    stopped = threading.Event()

    def fail() -> None:
        raise OSError("broken")

    def long() -> None:
        assert stopped.wait(timeout=60.0)

    with pytest.raises(OSError, match="broken"):
        side_by_side([long, fail], stopped.set, lambda: None)
    assert stopped.is_set()


def test_an_interrupt_of_the_caller_stops_the_rest():
    use_threads(2)
    stopped = threading.Event()

    def interrupt() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        side_by_side(
            [lambda: None if stopped.wait(timeout=60.0) else pytest.fail("not stopped")],
            stopped.set,
            interrupt,
        )
    assert stopped.is_set()
