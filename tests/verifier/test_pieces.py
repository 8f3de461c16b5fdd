"""The verifier's own distance to lines, arcs and helices, against a search that knows no formula."""

import numpy as np
import pytest
from judging import distance_from
from motions import Moves, helix, machine
from scipy.optimize import minimize_scalar

from planner.verifier.pieces import PIECE_ANGLE, program_pieces

M = machine()


@pytest.mark.slow
@pytest.mark.parametrize("rise", [0.0, 3.0, -30.0])
@pytest.mark.parametrize("sweep", [2 * np.pi, -0.4 * np.pi, 0.1, 5 * np.pi])
def test_the_distance_from_an_arc_is_the_searched_one(sweep, rise):
    start, center = (7.0, 1.0, 2.0), (1.0, -2.0)
    toolpath = Moves(start).arc(center, sweep, rise=rise).toolpath(M)
    pieces = program_pieces(toolpath)
    _, curve = helix(start, center, sweep, rise)
    rng = np.random.default_rng(1)
    for i, piece in list(enumerate(pieces.piece))[::3]:
        q = curve(np.array([rng.uniform(piece["x0"], piece["x1"])]))[0][0] + rng.uniform(-0.5, 0.5, 3)
        center_, e1, e2, drift = pieces.frame[piece["arc"]]
        radius, rate = pieces.turn[piece["arc"]]

        def apart(x, q=q, c=center_, e1=e1, e2=e2, drift=drift, radius=radius, rate=rate):
            return np.linalg.norm(
                c + radius * (np.cos(rate * x) * e1 + np.sin(rate * x) * e2) + drift * x - q
            )

        ends = (piece["x0"], piece["x1"])
        searched = minimize_scalar(apart, bounds=ends, method="bounded", options={"xatol": 1e-9}).fun
        wanted = min(searched, *(apart(x) for x in ends))
        assert distance_from(pieces, i, q) == pytest.approx(wanted, abs=1e-9)
    assert len(pieces.piece) == np.ceil(abs(sweep) / PIECE_ANGLE - 1e-6)


def test_the_distance_from_a_line():
    pieces = program_pieces(Moves().line(10).toolpath(M))
    assert distance_from(pieces, 0, np.array([4.0, 3.0, 0.0])) == pytest.approx(3.0, abs=1e-15)
    assert distance_from(pieces, 0, np.array([13.0, 4.0, 0.0])) == pytest.approx(5.0, abs=1e-15)


def test_the_budget_of_a_segment_is_the_larger_of_its_joints():
    toolpath = Moves().line(10).line(10, 10).line(20, 10).toolpath(M)
    fields = {name: getattr(toolpath, name) for name in toolpath.__dataclass_fields__}
    fields["tolerance"] = np.array([0.01, 0.02, 0.005, 0.001])
    pieces = program_pieces(type(toolpath)(**fields))
    np.testing.assert_array_equal(pieces.piece["budget"], [0.02, 0.02, 0.005])
    np.testing.assert_array_equal(pieces.joint["budget"], [0.01, 0.02, 0.005, 0.001])


def test_an_arc_that_does_not_end_where_it_says_is_refused():
    toolpath = Moves((10.0, 0, 0)).arc((0, 0), 2 * np.pi).toolpath(M)
    arcs = toolpath.arcs
    longer = type(arcs)(
        **{name: getattr(arcs, name) for name in arcs.__dataclass_fields__} | {"rate": arcs.rate * 1.001}
    )
    fields = {name: getattr(toolpath, name) for name in toolpath.__dataclass_fields__}
    with pytest.raises(ValueError, match="does not end where its arc does"):
        program_pieces(type(toolpath)(**{**fields, "arcs": longer}))
