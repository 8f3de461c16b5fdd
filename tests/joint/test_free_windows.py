"""The own solver of the free optimum: what its pieces claim, that ipopt finds the same, and what becomes of windows that fail."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_pieces import Alone, gaps_of, look, models, newton, rows_at, rows_out, slopes
from starts import MACHINE, PROGRAMS, begun, begun_on

from benchmarks.jobs import problems, random_lines
from benchmarks.solvers import tube_solvers
from planner.base.arrays import read_only
from planner.joint import groups, laws, own
from planner.joint import row_kinds as rows
from planner.joint.checks import worst_shares
from planner.joint.group import place_of
from planner.joint.guess import DEFAULT_CUT, Cut
from planner.joint.legs import put_places
from planner.joint.motion import integrated
from planner.joint.nlp import TubeNLP
from planner.joint.own import TubeOwn
from planner.joint.problem import window_of
from planner.joint.solvers import SOLVERS
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.tube import TubeMethod

CORNER, ARCS = PROGRAMS["corner"], PROGRAMS["arcs"]
# Share of the time by which ipopt may end elsewhere, begun where the own solver ended [-]; 1.6e-4 was seen (pushed: ipopt is slower).
SAME = {"corner": 2e-4, "arcs": 2e-4, "pushed": 2e-4, "turned": 2e-4}
# Fewer steps for those that ipopt takes longest on.
COARSER = dict.fromkeys(("arcs", "pushed"), Cut(per_unit=2.0))
MISSED = own.MISSED


# --- its pieces ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["corner", "arcs", "curves", "narrow", "pushed", "own", "powered"])
def test_slopes_are_the_differences_of_the_rows(name):
    """Of all rows whose vector is what moves; the radii of the feed are kept, and so are the tangents of order and arcs."""
    run, guess = begun(name)
    window = window_of(run, guess, 0, len(guess), MISSED, which=np.arange(len(run.laws)))
    x, u = window.x.copy(), window.u.copy()
    rng = np.random.default_rng(2)
    dx, du = 1e-6 * rng.normal(size=x.shape), 1e-6 * rng.normal(size=u.shape)
    dx[0] = 0.0
    at, after, before = (rows_at(window, x + k * dx, u + k * du) for k in (0, 1, -1))
    alone = Alone.of(window)
    look(alone)
    change = np.zeros((len(u), 4 * (alone.u.shape[1] - 1) + 1, 1))
    change[:, place_of(u.shape[1] - 1, alone.u.shape[1] - 1), 0] = np.hstack([dx[:-1], du])
    slope = rows_out(window, slopes(alone, change))
    more = 8 * (u.shape[1] - 1)
    exact = window.limits.on.copy()
    kept = [more + rows.FEED_ROWS + k for k in range(3)]
    kept += [more + row for row in (rows.ORDER_NODE, rows.ORDER_MID, rows.ARC)]
    # those of the tangential acceleration keep the speed that they are over: exact where they hold
    for kind, lo, hi in zip(
        window.limits.laws.kind, *(window.limits.laws.first[k:] for k in (0, 1)), strict=False
    ):
        pushed = slice(more + rows.LAW_ROWS + lo, more + rows.LAW_ROWS + hi)
        exact[:, pushed] &= (kind != laws.PUSH) | (np.abs(at[:, pushed]) < 1e-4)
    exact[:, kept] = False
    assert exact.any(axis=0).sum() > 12
    np.testing.assert_allclose(slope[exact], ((after - before) / 2)[exact], rtol=2e-3, atol=2e-9)


@pytest.mark.parametrize("name", ["corner", "arcs", "curves", "narrow", "pushed"])
def test_the_model_is_that_of_all_slopes_and_of_what_is_flat(name):
    """Of rows that all but touch, z/s grad g grad g', by the slopes in a random step; of rows far from that, z d2g of the rows at
    nodes, by the change of their slopes along a step of the node alone."""
    run, guess = begun(name)
    window = window_of(run, guess, 0, min(len(guess), 40), MISSED, which=np.arange(len(run.laws)))
    alone, rng = Alone.of(window), np.random.default_rng(8)
    look(alone)
    work, there = alone.work, alone.group.on > 0.0
    change = rng.normal(size=(alone.sizes.steps, len(alone.sizes.step), 1))

    def bent(s, z):
        """d'W d of every step."""
        work.s[:], work.z[:] = np.where(there, s, 1.0), np.where(there, z, 0.0)
        work.per_s[:] = there / work.s
        W = models(alone)
        W += np.swapaxes(np.tril(W, -1), 1, 2)
        return np.einsum("ns,nst,nt->n", change[..., 0], W, change[..., 0])

    weight, centre = rng.uniform(0.5, 1.0, there.shape), alone.group.centre.copy()
    alone.group.centre[:] = 0.0
    slope = slopes(alone, change)
    wanted = (np.where(there, weight, 0.0) * slope**2)[..., 0].sum(axis=1)
    np.testing.assert_allclose(bent(1e-9, 1e-9 * weight), wanted, rtol=1e-6)
    rows_of_node = 8 * len(alone.sizes.axes) + np.array([rows.FEED_NODE, rows.TUBE_NODE])
    change[:, 3 * len(alone.sizes.axes) :] = 0.0
    z = np.zeros(there.shape)
    z[:, rows_of_node] = 1.0
    found = bent(1e12, z)
    axes, group = len(alone.sizes.axes), alone.group
    dp, dv = change[:, :axes, 0], change[:, axes : 2 * axes, 0]
    on, moves = there[:, rows_of_node, 0], work.moves[:, 0, 0]
    line = group.line[:, 0] > 0.0
    along = (group.drift[..., 0] * dp).sum(axis=1) ** 2 * group.per_drift[:, 0] * moves
    wanted = on[:, 0] * group.feed_node[:, 0] * (dv**2).sum(axis=1)
    wanted = wanted + on[:, 1] * group.room_node[:, 0] * ((dp**2).sum(axis=1) - along)
    np.testing.assert_allclose(found[line], wanted[line], rtol=1e-6, atol=1e-9)
    alone.group.centre[:] = centre


def test_rows_of_the_feed_are_its_bernstein_coefficients():
    """|y| <= r where the coefficient of the squared feed is no more than F^2: their differences agree."""
    run, guess = begun("corner")
    window = window_of(run, guess, 0, len(guess), MISSED)
    axes = window.u.shape[1] - 1
    rng = np.random.default_rng(3)
    x, u = rng.normal(size=window.x.shape), rng.uniform(0.1, 1.0, size=window.u.shape)
    feed = 10.0 + rng.uniform(size=len(u))
    limits = window.limits._replace(feed=feed, on=np.ones_like(window.limits.on))
    g = rows_at(window._replace(limits=limits), x, u)[:, 8 * axes + rows.FEED_ROWS :][:, :3]
    v, a, j, h = x[:-1, axes : 2 * axes], x[:-1, 2 * axes :], u[:, :axes], u[:, axes:]
    w = [v, v + h * a / 2, v + h * a + h * h * j / 2]

    def times(one, other):
        return (one * other).sum(axis=1)

    wanted = [times(w[0], w[1]), (2 * times(w[1], w[1]) + times(w[0], w[2])) / 3, times(w[1], w[2])]
    y = [v + h * a / 4, v + h * a / 2 + h * h * j / 12, v + 3 * h * a / 4 + h * h * j / 4]
    for m in range(3):
        square = times(y[m], y[m])
        radius = square / (2.0 * g[:, m] + 1.0)  # its square
        np.testing.assert_allclose(square - radius + feed**2, wanted[m], atol=1e-9)


def test_the_recursion_solves_the_system_of_all_steps():
    """Against the least of the quadratic model by all controls at once, with the last node's gap weighted as in the
    recursion."""
    window = window_of(*begun("corner"), 0, 12, MISSED)
    alone = Alone.of(window)
    sizes, group, _, x, u, _, work = alone
    rng, N, (S, C) = np.random.default_rng(4), sizes.steps, (x.shape[1], u.shape[1])
    A = C - 1
    look(alone)
    there = group.on > 0.0
    work.s[:] = np.where(there, rng.uniform(0.5, 1.0, there.shape), 1.0)
    work.per_s[:] = there / work.s
    work.z[:] = np.where(there, rng.uniform(0.1, 1.0, there.shape), 0.0)
    work.q[:] = work.z * (work.g + work.s) * work.per_s
    gap = 1e-3 * rng.normal(size=work.gap.shape)
    gap[:, 2::A] = 0.0  # of the axis that the kernel has beside nothing else holds the jerk
    work.gap[:] = gap
    pull, rho, aim, end = 0.5, 1e6, 0.01, rng.normal(size=(S, 1))
    W = models(alone)
    assert newton(alone, pull, rho, aim, end) == 0.0
    W += np.swapaxes(np.tril(W, -1), 1, 2)
    W[:, -1, -1] += 2.0 * pull * group.per_h[:, 0] ** 2
    for k in range(A):
        W[:, S + k, S + k] += group.smooth[:, 0] * group.per_box[0, k, 0] ** 2
    # the gradient, by slopes of the rows along each direction
    w = np.zeros((N, S + C))
    q = there * (aim + work.z * (work.g + work.s)) / work.s
    q[:, 8 * A + rows.TUBE_NODE] += group.centre
    for k in range(S + C):
        change = np.zeros((N, S + C, 1))
        change[:, k] = 1.0
        w[:, k] = (q * slopes(alone, change))[..., 0].sum(axis=1)
    w[:, -1] += 1.0 + 2.0 * pull * (u[:, A, 0] - group.h[:, 0]) * group.per_h[:, 0] ** 2
    w[:, S : S + A] += group.smooth * u[:, :A, 0] * group.per_box[0, :, 0] ** 2
    # nodes as affine functions of all controls, by differences of the kinematics, which are exact for them
    node, shift = np.zeros((N + 1, S, N * C)), np.zeros((N + 1, S))
    for i in range(N):
        h, B = u[i, A, 0], np.zeros((S, C))
        for c in range(C):
            more, less = u.copy(), u.copy()
            more[i, c], less[i, c] = more[i, c] + 1e-5, less[i, c] - 1e-5
            B[:, c] = (gaps_of(alone, more) - gaps_of(alone, less))[i] / 2e-5
        step = np.kron([[1.0, h, h * h / 2.0], [0.0, 1.0, h], [0.0, 0.0, 1.0]], np.eye(A))
        node[i + 1], shift[i + 1] = step @ node[i], step @ shift[i] + gap[i, :, 0]
        node[i + 1][:, i * C : (i + 1) * C] += B
    H, f = rho * node[N].T @ node[N], node[N].T @ (rho * shift[N] + end[:, 0])
    for i in range(N):
        of_step = np.zeros((S + C, N * C))
        of_step[:S] = node[i]
        of_step[S:, i * C : (i + 1) * C] = np.eye(C)
        at = np.concatenate([shift[i], np.zeros(C)])
        H += of_step.T @ W[i] @ of_step
        f += of_step.T @ (W[i] @ at + w[i])
    wanted = -np.linalg.solve(H, f)
    found = work.du[..., 0].ravel()
    np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-6 * np.abs(wanted).max())
    np.testing.assert_allclose(
        work.dx[..., 0], node @ wanted + shift, rtol=1e-5, atol=1e-6 * np.abs(work.dx).max()
    )


def test_shares_are_those_of_a_fine_sampling():
    run, _ = begun("corner")
    steps = 20
    rng = np.random.default_rng(5)
    h, jerk = rng.uniform(1e-3, 4e-3, steps), run.jerk * rng.uniform(-1.0, 1.0, (steps, 2))
    begin = np.array([[0.0, 0.0], [20.0, 15.0], [0.0, 0.0]])
    state = integrated(begin, h, jerk)
    leg = read_only(np.zeros(steps, np.int64))
    limit, tube = worst_shares(run.keeps, leg, h, state, jerk, np.zeros((steps, 3)))
    t = np.linspace(0.0, 1.0, 2001)[:, None, None] * h[None, :, None]
    p, v, a = (state[:-1, k] for k in range(3))
    speeds, pushes = v + t * (a + t * jerk / 2), a + t * jerk
    places = p + t * (v + t * (a / 2 + t * jerk / 6))
    shares = [np.abs(jerk) / run.jerk, np.abs(pushes) / run.acceleration, np.abs(speeds) / run.velocity]
    shares.append(np.linalg.norm(speeds, axis=2) / run.feed[0])
    assert limit == pytest.approx(max(share.max() for share in shares), rel=1e-6)
    assert (tube[0] >= np.abs(places[..., 1]).max(axis=0) / run.budget[0]).all()


def test_places_on_a_line_go_never_back_and_the_farthest_is_moved_by_as_little_as_can_be():
    """By half of what the motion goes back by: of two points, one of which is before the other, one has to be."""
    run, _ = begun("corner")
    steps = 12
    rng = np.random.default_rng(11)
    h, jerk = rng.uniform(1e-3, 4e-3, steps), run.jerk * rng.uniform(-1.0, 1.0, (steps, 2))
    turning = np.array([[0.3 * run.length[0], 0.0], [-30.0, 5.0], [4000.0, 0.0]])
    state = integrated(turning, h, jerk)
    leg, place, stays = np.zeros(steps, np.int64), np.zeros((steps, 3)), np.zeros((steps, 3), np.bool_)
    legs = run.keeps.legs
    last = put_places(legs, leg, True, state.reshape(steps + 1, -1), h, place, stays)
    third = h[:, None] / 3.0
    p, v = state[:, 0], state[:, 1]
    inner = np.stack([p[:-1] + third * v[:-1], p[1:] - third * v[1:]], axis=1)
    nearest = np.concatenate([p[:-1, None], inner], axis=1)[:, :, 0].ravel()
    nearest[0] = 0.0  # at a vertex
    back = np.maximum.accumulate(nearest) - np.minimum.accumulate(nearest[::-1])[::-1]
    assert back.max() > 0.1  # the motion does go back
    assert (np.diff(place.ravel()) >= 0.0).all()
    assert np.abs(place.ravel() - nearest).max() == pytest.approx(back.max() / 2.0, rel=1e-9)
    np.testing.assert_array_equal(stays.ravel()[1:], (np.abs(place.ravel() - nearest) > 1e-9)[1:])
    assert last == pytest.approx(p[-1, 0])


# --- what it finds -------------------------------------------------------------------------------------------------------------


@pytest.mark.shows("tube", "compared: ipopt on the same problem finds nothing more")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["corner", "arcs", "pushed", "turned"])
def test_ipopt_finds_nothing_more_where_it_ends(name):
    run, guess = begun(name, COARSER.get(name, DEFAULT_CUT))
    mine = tube_solvers.Precise().solve(run, guess)
    ended = tube_solvers.again(run, guess, mine)
    other = TubeNLP().solve_from(run, ended, ended)
    assert mine.steps is not None
    assert mine.kept is not None
    assert not mine.kept.any()
    assert mine.steps.h.sum() == pytest.approx(other.steps.h.sum(), rel=SAME[name])
    assert mine.steps.h.sum() < guess.h.sum() * (1 - 1e-3)


@pytest.mark.usual_sizes
def test_windows_find_what_the_whole_run_finds(monkeypatch):
    run, guess = begun("pentagon")
    whole = TubeOwn().solve(run, guess)
    for name in ("WHOLE", "WINDOW"):
        monkeypatch.setattr(own, name, (len(guess) + 1) // 2)
    monkeypatch.setattr(own, "OVERLAP", len(guess) // 5)
    monkeypatch.setattr(own, "JOIN_WITHIN", 5)
    parts = TubeOwn().solve(run, guess)
    assert (whole.windows, parts.windows) == (1, 3)  # two, and the join
    assert parts.steps is not None
    assert whole.steps is not None
    # what runs at the feed, where jerk weighs more, is told by the start, and of joins by what the windows have found
    assert parts.steps.h.sum() == pytest.approx(whole.steps.h.sum(), rel=5e-4)
    for name, tiny in (("position", 1e-9), ("velocity", 1e-8), ("acceleration", 1e-6)):  # joins do not jump
        found = parts.steps
        state = np.stack([found.position, found.velocity, found.acceleration], axis=1)
        ends = np.array(
            [integrated(s, found.h[i : i + 1], found.jerk[i : i + 1])[-1] for i, s in enumerate(state)]
        )
        column = ("position", "velocity", "acceleration").index(name)
        np.testing.assert_allclose(ends[:-1, column], state[1:, column], atol=tiny)


def test_the_normal_acceleration_holds_between_nodes():
    """Its rows are enough for whole steps: what solves a window keeps it everywhere, and uses all of it."""
    program, machine = random_lines.job(40)
    machine = machine.model_copy(update={"normal_acceleration": 0.3 * machine.axes["x"].acceleration})
    run, guess = begun_on(program, machine=machine)
    assert np.isfinite(run.across_max).all()
    solution = TubeOwn().solve(run, guess)
    assert solution.solved == 1
    found = solution.steps
    t = np.linspace(0.0, 1.0, 201)[:, None, None] * found.h[:, None]
    v, a = found.velocity + t * (found.acceleration + t * found.jerk / 2), found.acceleration + t * found.jerk
    along = (v * a).sum(axis=2, keepdims=True) / np.maximum((v**2).sum(axis=2, keepdims=True), 1e-12)
    shares = np.linalg.norm(a - along * v, axis=2) / run.across_max[guess.leg]
    assert 0.99 < shares.max() <= 1.0 + 1e-9


def test_where_a_window_fails_the_start_stays_and_is_joined(monkeypatch):
    """The motion of the start between two windows that were found: verified, nothing jumps, and it is said."""
    solve = groups.solve_windows

    def hasty(asked, width):
        inner = [one.window.x[0].any() and abs(one.window.x[-1, 2:]).max() > 0 for one in asked]
        return [
            one._replace(done=one.done and not fails)
            for one, fails in zip(solve(asked, width), inner, strict=True)
        ]

    monkeypatch.setattr(groups, "solve_windows", hasty)
    monkeypatch.setattr(own, "WHOLE", 60)
    monkeypatch.setattr(own, "WINDOW", 60)
    monkeypatch.setattr(own, "OVERLAP", 20)
    monkeypatch.setattr(own, "JOIN_WITHIN", 10)
    start = OptimalMethod(corner="bezier")
    job = problems.pentagon(side=6.0)
    made = TubeMethod(start=start).plan(job, MACHINE).require()
    assert made.verdict.passed, made.verdict.faults
    assert own.KEPT in made.sentence
    assert made.trajectory.cycle_time < start.plan(job, MACHINE).trajectory.cycle_time
    seen, dt = made.trajectory, MACHINE.dt
    for column, rate in ((seen.position, 100.0), (seen.velocity, 2000.0), (seen.acceleration, 2e5)):
        assert np.abs(np.diff(column, axis=0)).max() <= rate * dt * (1 + 1e-6)


@pytest.mark.parametrize("k", [0.1, 7.0])
def test_scaled_lengths_and_limits_take_the_same_time(k):
    machine = problems.machine(velocity=100 * k, acceleration=2000 * k, jerk=2e5 * k, tolerance=0.05 * k)
    scaled = problems.polyline(k * np.array([[0, 0], [4, 0], [4, 4]]), feed=100.0 * k)
    times = [
        TubeMethod(start=OptimalMethod(corner="bezier")).plan(job, limits).trajectory.cycle_time
        for job, limits in ((CORNER, MACHINE), (scaled, machine))
    ]
    assert times[1] == pytest.approx(times[0], rel=1e-5)


def test_backwards_takes_the_same_time():
    points = np.array([[0, 0], [4, 0], [5, 3], [1, 4]])
    times = [
        TubeMethod(start=OptimalMethod(corner="bezier"))
        .plan(problems.polyline(way), MACHINE)
        .trajectory.cycle_time
        for way in (points, points[::-1] - points[-1])
    ]
    assert times[1] == pytest.approx(times[0], rel=2e-4)


def test_every_solver_has_its_name():
    from planner.base.names import METHODS

    assert tuple(SOLVERS) == METHODS["tube"].solvers
