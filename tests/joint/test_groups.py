"""Windows of many searches in groups: what is found depends neither on the group nor on threads, and no group is larger, mixed or in
vain."""

from __future__ import annotations

import dataclasses
import threading
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from kernel_pieces import Alone, look
from starts import MACHINE, PROGRAMS, begun, begun_on

from planner.base.lanes import WIDTH as LANES
from planner.base.threads import use_threads
from planner.joint import groups, own
from planner.joint.groups import Sort, Sweep, searched
from planner.joint.interior_point import Tuning
from planner.joint.nlp import PULL
from planner.joint.own import TubeOwn
from planner.joint.problem import window_of
from planner.joint.window_solver import Asked, kind_of, solve_windows
from planner.machine.user_limit import PathLimit

pytestmark = pytest.mark.usefixtures("threads_as_before")
NAMES = ("corner", "arcs", "curves", "narrow", "pentagon", "own", "powered")


class Fence(PathLimit):
    """A bound that jumps from one place to the next."""

    name = "fence"

    def velocity(self, at):
        return np.where((at.x > 1.3) & (at.x < 4.7), 35.0, 90.0)

    def acceleration(self, at):
        return 2000.0 + 0.0 * at.x

    def jerk(self, at):
        return 2e5 + 0.0 * at.x


LONG = 1 << 20  # steps: enough for threads


def asked_for(steps: int, axes: int = 3) -> SimpleNamespace:
    """A window of so many steps, of which nothing else is read here."""
    window = SimpleNamespace(
        u=np.empty((steps, axes + 1)),
        limits=SimpleNamespace(passed=np.zeros(1, bool)),
        legs=SimpleNamespace(radius=np.zeros(1)),
        which=(),
    )
    return SimpleNamespace(window=window, tuning=SimpleNamespace(gap=1e-3))


def task(windows: list[SimpleNamespace]):
    for one in windows:
        assert (yield one) == one.window.u.shape


def search(sweeps: list[Sweep]):
    yield from sweeps
    return len(sweeps)


@pytest.fixture
def solved(monkeypatch) -> list[list[tuple[int, int]]]:
    """The groups that are solved: the shapes of their windows, which are the answers."""
    seen: list[list[tuple[int, int]]] = []

    def solve(asked, width):
        assert len(asked) <= (groups.QUEUE if width > 1 else 1)
        seen.append([one.window.u.shape for one in asked])
        return seen[-1]

    monkeypatch.setattr(groups, "solve_windows", solve)
    return seen


@pytest.mark.parametrize("threads", [1, 3])
def test_all_windows_are_solved_once_in_groups_of_one_kind_and_about_one_length(solved, threads):
    use_threads(threads)
    rng = np.random.default_rng(1)
    windows = [
        [[asked_for(int(n), int(rng.integers(2, 4))) for n in rng.integers(10, 90, 3)] for _ in range(4)]
        for _ in range(30)
    ]
    found = searched(
        [search([[task(w) for w in one[:3]], [], [task(w) for w in one[3:]]]) for one in windows], LONG
    )
    assert found == [3] * 30
    shapes = [shape for group in solved for shape in group]
    assert sorted(shapes) == sorted(w.window.u.shape for one in windows for t in one for w in t)
    assert max(map(len, solved)) > LANES
    assert all(len({axes for _, axes in group}) == 1 for group in solved)
    if threads == 1:
        used = sum(map(sum, ([steps for steps, _ in group] for group in solved)))
        assert used > 0.8 * sum(max(len(group), LANES) * max(group)[0] for group in solved)


def test_only_windows_of_one_kind_are_together_and_what_is_solved_by_itself_comes_first():
    waiting = [Sort(50, 1e-3), Sort(90, 1e-5), Sort(49, 1e-3), Sort(80, 1e-5), Sort(70, 1e-5)]
    assert groups.together(waiting) == [1, 3, 4]
    assert groups.together([*waiting, Sort(20, None), Sort(30, None)]) == [6]


def test_windows_side_by_side_have_no_laws_few_axes_and_bend_all_or_none():
    straight = asked_for(20)
    bent = asked_for(20)
    bent.window.legs.radius = np.ones(1)
    held = asked_for(20)
    held.window.which = (0,)
    assert kind_of(straight) == kind_of(asked_for(90)) is not None
    assert kind_of(straight) != kind_of(asked_for(20, axes=2))
    assert kind_of(straight) != kind_of(bent) is not None
    assert [kind_of(one) for one in (held, asked_for(20, axes=5))] == [None] * 2


@pytest.mark.parametrize("threads", [1, 3])
def test_searches_of_few_steps_have_their_windows_solved_one_at_a_time(solved, threads):
    use_threads(threads)
    searched([search([[task([asked_for(20)])]]) for _ in range(50)], groups.IN_LANES)
    assert [len(group) for group in solved] == [1] * 50


def test_searches_are_begun_when_windows_are_wanted(solved):
    use_threads(1)
    begun_at, going = [], 0

    def one():
        nonlocal going
        going += 1
        begun_at.append(going)
        yield from search([[task([asked_for(20), asked_for(20)])]])
        going -= 1

    searched((one() for _ in range(500)), LONG)
    assert going == 0
    assert max(begun_at) <= groups.WAITING + LANES


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_an_error_or_an_interrupt_ends_all_searches(monkeypatch, solved, threads, error):
    use_threads(threads)
    solve, many = groups.solve_windows, 0

    def breaks(asked, width):
        nonlocal many
        many += 1
        if many == 5:
            raise error
        return solve(asked, width)

    monkeypatch.setattr(groups, "solve_windows", breaks)
    before = threading.active_count()
    for steps in (LONG, 0):
        many = 0
        with pytest.raises(error):
            searched([search([[task([asked_for(20)] * 3)]]) for _ in range(5_000)], steps)
        assert threading.active_count() == before
        assert many < 5_000


@pytest.fixture
def small_windows(monkeypatch) -> None:
    for name, steps in (("WHOLE", 40), ("WINDOW", 40), ("OVERLAP", 8), ("JOIN_WITHIN", 4), ("LEAST", 15)):
        monkeypatch.setattr(own, name, steps)


@cache
def jobs():
    """Searches of runs of lines, arcs and laws of the user, and what each finds by itself, one after
    the other."""
    solvers = [TubeOwn(gap=1e-3), TubeOwn(gap=1e-3, stays=False)]
    runs = [*map(begun, NAMES), begun_on(PROGRAMS["pentagon"], machine=MACHINE.with_own([Fence()]))]
    made = [(solver, *run) for run in runs for solver in solvers]
    use_threads(1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(groups, "solve_windows", in_lanes)
        return made, [solver.solve(run, guess) for solver, run, guess in made]


def in_lanes(asked, width=LANES):
    """Also what small plans solve on single numbers, which are rounded in another order; but what no lanes are for."""
    return solve_windows(asked, 1 if kind_of(asked[0]) is None else LANES)


@pytest.mark.shows("parallel", "exact: the same bytes")
@pytest.mark.usefixtures("small_windows")
@pytest.mark.parametrize(("threads", "width", "waiting", "seed"), [(1, 1, 1, 0), (1, 9, 32, 2), (2, 3, 8, 3)])
def test_the_same_bytes_in_any_group(monkeypatch, threads, width, waiting, seed):
    """In windows of a few steps, some of which fail."""
    made, alone = jobs()
    assert any(one.steps is not None and one.windows > one.solved for one in alone)
    assert any(one.steps is None for one in alone)
    rng = np.random.default_rng(seed)

    def shuffled(waiting, most):
        order = rng.permutation(len(waiting)).tolist()
        kind = waiting[order[0]].kind
        return [at for at in order if waiting[at].kind == kind][: 1 if kind is None else width]

    monkeypatch.setattr(groups, "together", shuffled)
    monkeypatch.setattr(groups, "solve_windows", in_lanes)
    monkeypatch.setattr(groups, "WAITING", waiting)
    use_threads(threads)
    order = rng.permutation(len(made)).tolist()
    found = searched([made[k][0].search(*made[k][1:]) for k in order], LONG)
    for one, other in zip(found, (alone[k] for k in order), strict=True):
        assert one.sentence == other.sentence
        assert (one.steps is None) == (other.steps is None)
        if one.steps is None:
            continue
        assert (one.windows, one.solved, one.iterations) == (other.windows, other.solved, other.iterations)
        assert one.price.tobytes() == other.price.tobytes()
        for column in dataclasses.fields(one.steps):
            assert getattr(one.steps, column.name).tobytes() == getattr(other.steps, column.name).tobytes()


@pytest.mark.parametrize("width", [1, 4])
@pytest.mark.parametrize("stays", [True, False])
@pytest.mark.parametrize("around", [True, False])
def test_what_is_left_of_the_start_is_searched_once_more_from_inside_of_what_was_found(
    monkeypatch, stays, around, width
):
    """The second of five windows fails, and is found from further outside; where that fails too the start stays there,
    or nothing of the run is found, whatever the group."""
    run, guess = begun("pentagon")
    for name in ("WHOLE", "WINDOW"):
        monkeypatch.setattr(own, name, len(guess) // 5 + 1)
    monkeypatch.setattr(own, "OVERLAP", len(guess) // 20)
    monkeypatch.setattr(own, "JOIN_WITHIN", 5)
    monkeypatch.setattr(own, "LEAST", len(guess))  # no window is divided
    begun_at, solve = list[bytes](), groups.solve_windows

    def some_fail(asked, _):
        found = solve(asked, 1) if width == 1 else in_lanes(asked)
        for k, one in enumerate(asked):
            origin = one.window.origin.tobytes()
            begun_at.extend([origin] if origin not in begun_at else [])
            # of five windows, four joins, and the one around what is left
            if begun_at.index(origin) == 1 or (begun_at.index(origin) == 9 and not around):
                found[k] = found[k]._replace(done=False)
        return found

    monkeypatch.setattr(groups, "solve_windows", some_fail)
    use_threads(1)
    found = TubeOwn(stays=stays).solve(run, guess)
    assert len(begun_at) == 10
    if not around and not stays:
        assert found.steps is None
    else:
        assert found.kept is not None
        assert found.kept.any() == (not around)


@pytest.mark.slow
def test_lanes_find_what_single_numbers_find():
    """The kernel on lanes against itself on single numbers, in any order and beside any others."""
    asked = []
    for name in ("corner", "pentagon", "pushed", "own", "powered", "arcs", "curves", "narrow"):
        run, guess = begun(name)
        missed = own.MISSED
        window = window_of(run, guess, 0, len(guess), missed, which=np.arange(0))
        asked.append(Asked(window, Tuning(PULL, own.PROX, 1e-4, missed, 1.0, *own.START)))

    def solved(order, width):
        copies = [
            one._replace(
                window=one.window._replace(
                    x=one.window.x.copy(), u=one.window.u.copy(), place=one.window.place.copy()
                )
            )
            for one in (asked[at] for at in order)
        ]
        ended = solve_windows(copies, width)
        return {at: (end, one.window) for at, end, one in zip(order, ended, copies, strict=True)}

    order = list(range(len(asked)))
    together, reverse, queued = {}, {}, {}
    for kind in {kind_of(one) for one in asked}:
        of_kind = [at for at in order if kind_of(asked[at]) == kind]
        queued |= solved(
            [*of_kind[:1] * LANES, *of_kind], LANES
        )  # behind others, in a lane that these have had
        of_kind = of_kind[:LANES]
        together |= solved(of_kind, LANES)
        reverse |= solved(of_kind[::-1], LANES)
    assert sum(end.done for end, _ in together.values()) > LANES
    for at in together:
        end, window = together[at]
        alone = solved([at], 1)[at]
        for beside in (reverse[at], queued[at]):
            assert end[:2] == beside[0][:2]
            for mine, other in ((end.z, beside[0].z), (window.x, beside[1].x), (window.u, beside[1].u)):
                np.testing.assert_array_equal(mine, other)
        if end.done:  # those that are not wander
            assert end[:2] == alone[0][:2]
            np.testing.assert_allclose(window.u, alone[1].u, atol=1e-6 * np.abs(window.u).max())


@pytest.mark.parametrize("name", ["corner", "arcs"])
def test_products_of_slacks_and_multipliers_are_what_is_asked_for_at_least(name):
    """Rows with less hold steps up once their slack is small: windows went on to the last iteration."""
    run, guess = begun(name)
    alone = Alone.of(window_of(run, guess, 0, len(guess), own.MISSED, which=np.arange(0)))
    look(alone, 0.25)
    np.testing.assert_array_equal(alone.work.s * alone.work.z, 0.25 * (alone.group.on > 0.0))
