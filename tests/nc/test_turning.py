"""Roughing cycles and threads of lathes as geometry: passes, depths, where they end, and what is left for the finishing cut."""

from __future__ import annotations

import cmath
import math
from itertools import pairwise

import numpy as np
import pytest

from planner.nc.lathe_cuts import LatheThread, lathe_depths, thread_passes
from planner.nc.turning import (
    Contour,
    Leg,
    Roughing,
    exchanged,
    facing,
    pattern_repeat,
    stock_removal,
)

# A shaft: face, chamfer, cylinder, fillet (an arc about (-40, 30)), cylinder, shoulder.
SHAFT = Contour(
    complex(2.0, 32.0),
    True,
    (
        Leg(complex(2.0, 8.0)), Leg(complex(0.0, 8.0)), Leg(complex(-2.0, 10.0)), Leg(complex(-30.0, 10.0)),
        Leg(complex(-40.0, 20.0), -1, complex(-30.0, 20.0)), Leg(complex(-60.0, 20.0)), Leg(complex(-60.0, 30.0)),
    ),
)  # fmt: skip
ALLOWANCE = complex(0.1, 0.25)


def surface(contour: Contour, by: complex, count: int = 400) -> np.ndarray:
    """Points (n,) of a moved profile behind its first point."""
    at, points = contour.legs[0].end, []
    for leg in contour.legs[1:]:
        part = np.linspace(0.0, 1.0, count)
        if leg.turning:
            sweep = leg.turning * (
                cmath.phase((leg.end - leg.centre) / (at - leg.centre)) * leg.turning % (2 * math.pi)
            )
            points.append(leg.centre + (at - leg.centre) * np.exp(1j * sweep * part))
        else:
            points.append(at + (leg.end - at) * part)
        at = leg.end
    return np.concatenate(points) + by


def mirrored(contour: Contour) -> Contour:
    """The profile inside of a bore: x is measured from 40 the other way."""
    legs = tuple(
        Leg(complex(g.end.real, 40 - g.end.imag), -g.turning, complex(g.centre.real, 40 - g.centre.imag))
        for g in contour.legs
    )
    return Contour(complex(contour.start.real, 40 - contour.start.imag), contour.fast, legs)


def cuts(steps: list[Leg], start: complex) -> list[tuple[complex, complex]]:
    """Beginning and end of the moves at the feed."""
    found, at = [], start
    for step in steps:
        if not step.fast:
            found.append((at, step.end))
        at = step.end
    return found


@pytest.mark.parametrize("inside", [False, True])
def test_passes_of_g71_end_on_the_moved_profile(inside: bool) -> None:
    contour = mirrored(SHAFT) if inside else SHAFT
    out = -1.0 if inside else 1.0
    allowance = complex(0.1, 0.25 * out)
    steps = list(stock_removal(contour, Roughing(3.0, 0.5, allowance)))
    passes = [(a, b) for a, b in cuts(steps, contour.start)[: -len(SHAFT.legs) + 1] if a.imag == b.imag]
    top, first = contour.start.imag + allowance.imag, contour.legs[0].end.imag + allowance.imag
    assert len(passes) == math.ceil(abs(top - first) / 3.0) - 1
    np.testing.assert_allclose(
        [a.imag for a, _ in passes], top - out * 3.0 * np.arange(1, len(passes) + 1), atol=1e-12
    )
    line = surface(contour, allowance)
    for _, end in passes:
        assert np.abs(line - end).min() < 0.06  # the spacing of the profile's points
        assert np.interp(end.real, line.real[::-1], line.imag[::-1]) * out <= end.imag * out + 0.06


def test_the_last_pass_is_the_profile_with_its_allowance() -> None:
    for faces in (False, True):
        contour = (
            SHAFT
            if not faces
            else Contour(
                complex(2.0, 32.0),
                False,
                (
                    Leg(complex(-30, 32)),
                    *(Leg(complex(z, x)) for z, x in ((-30, 30), (-20, 20), (-20, 10), (0, 8))),
                ),
            )
        )
        job = contour, Roughing(4.0, 1.0, ALLOWANCE)
        steps = list(facing(stock_removal, *job) if faces else stock_removal(*job))
        last = [step for step in steps if not step.fast][-len(contour.legs) + 1 :]
        for leg, wanted in zip(last, contour.legs[1:], strict=True):
            assert leg.end == pytest.approx(wanted.end + ALLOWANCE)
            assert leg.turning == wanted.turning
        assert steps[-1].end == contour.start
        assert steps[-1].fast


def test_no_pass_cuts_into_the_moved_profile() -> None:
    """Every point of every cut, and of every retract, lies on the tool's side of the moved profile."""
    rng = np.random.default_rng(5)
    for _ in range(30):
        z, x = 0.0, float(rng.uniform(2, 5))
        legs = [Leg(complex(2.0, x)), Leg(complex(0.0, x))]
        for _ in range(int(rng.integers(2, 7))):
            size = float(rng.uniform(1, 6))
            kind = int(rng.integers(0, 4))
            if kind == 0:
                z -= size
                legs.append(Leg(complex(z, x)))
            elif kind == 1:
                z, x = z - size, x + float(rng.uniform(0.5, 4))
                legs.append(Leg(complex(z, x)))
            else:  # a quarter, hollow (clockwise about a centre above) or round
                hollow = kind == 2
                centre = complex(z, x + size) if hollow else complex(z - size, x)
                z, x = z - size, x + size
                legs.append(Leg(complex(z, x), -1 if hollow else 1, centre))
        contour = Contour(complex(2.0, x + float(rng.uniform(0, 3))), True, tuple(legs))
        steps = list(stock_removal(contour, Roughing(float(rng.uniform(0.5, 3)), 0.3, ALLOWANCE)))
        line = surface(contour, ALLOWANCE, 2000)
        order = np.argsort(line.real, kind="stable")
        for begin, end in cuts(steps, contour.start)[: -len(legs) + 1]:
            inner = np.linspace(begin.real, end.real, 50)[:-1]
            highest = np.interp(inner, line.real[order], line.imag[order], left=-np.inf, right=-np.inf)
            assert (np.maximum(begin.imag, end.imag) >= highest - 1e-2).all()


def test_g72_is_g71_with_x_and_z_exchanged() -> None:
    given = Roughing(2.0, 0.4, ALLOWANCE)
    other = Roughing(2.0, 0.4, complex(0.25, 0.1))
    turned = [exchanged(step) for step in facing(stock_removal, exchanged(SHAFT), other)]
    assert turned == list(stock_removal(SHAFT, given))


def test_what_the_passes_leave_more_is_taken_by_the_last() -> None:
    plain = cuts(list(stock_removal(SHAFT, Roughing(3.0, 0.5, ALLOWANCE))), SHAFT.start)
    more = cuts(
        list(stock_removal(SHAFT, Roughing(3.0, 0.5, ALLOWANCE, complex(0.2, 0.0)))),
        SHAFT.start,
    )
    assert plain[-len(SHAFT.legs) + 1 :] == more[-len(SHAFT.legs) + 1 :]
    for (_, end), (_, other) in zip(plain[:3], more[:3], strict=True):
        assert other == pytest.approx(end + 0.2)


def test_g73_is_the_profile_again_and_again() -> None:
    steps = list(pattern_repeat(SHAFT, 4, complex(1.5, 3.0), ALLOWANCE))
    size = len(SHAFT.legs) + 1
    assert len(steps) == 4 * size + 1
    for n in range(4):
        by = ALLOWANCE + complex(1.5, 3.0) * (3 - n) / 3
        part = steps[n * size : (n + 1) * size]
        assert part[0].end == pytest.approx(SHAFT.start + by)
        for step, leg in zip(part[1:], SHAFT.legs, strict=True):
            assert step.end == pytest.approx(leg.end + by)
    assert [s.end for s in pattern_repeat(SHAFT, 1, 5 + 5j, 0j)][1] == SHAFT.legs[0].end


@pytest.mark.parametrize(
    ("legs", "said"),
    [
        ((Leg(2 + 8j), Leg(-5 + 8j), Leg(-4 + 10j)), "z turns back"),
        ((Leg(2 + 8j), Leg(-4 + 14j, -1, -4 + 8j)), "z turns back"),  # more than a half circle
        ((Leg(2 + 8j),), "no move"),
    ],
)
def test_refused_profiles(legs: tuple[Leg, ...], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        list(stock_removal(Contour(2 + 20j, True, legs), Roughing(1.0, 0.1, 0j)))


def test_refused_depths() -> None:
    for depth in (0.0, -1.0, 1e-9):
        with pytest.raises(ValueError, match="depth"):
            list(stock_removal(SHAFT, Roughing(depth, 0.1, 0j)))
    with pytest.raises(ValueError, match="passes"):
        list(pattern_repeat(SHAFT, 0, 0j, 0j))


M20 = LatheThread(complex(5, 12), complex(-25, 8.466), height=1.534, first=0.485, lead=2.5)


def test_passes_of_a_thread_take_the_same_section() -> None:
    """The section of a V thread grows with the square of its depth: by the same amount in every pass but the last."""
    found = np.array(list(lathe_depths(M20)))
    grown = np.diff(found[:-1] ** 2)
    np.testing.assert_allclose(grown, M20.first**2, rtol=1e-12)
    assert found[-1] == M20.height
    assert len(found) == math.ceil((M20.height / M20.first) ** 2)
    least = np.array(
        list(lathe_depths(LatheThread(**{**vars(M20), "least": 0.1, "finish": 0.05, "springs": 3})))
    )
    assert (np.diff(least[:-4]) >= 0.1 - 1e-12).all()
    np.testing.assert_allclose(least[-4:], [1.484, 1.534, 1.534, 1.534])


def test_a_thread_is_cut_along_its_flank() -> None:
    found = list(thread_passes(LatheThread(**{**vars(M20), "angle": 60.0, "chamfer": 2.0})))
    cut = [(before.end, one) for before, one in pairwise(found) if one.pitch]
    for (begin, straight), (_, out) in zip(cut[::2], cut[1::2], strict=True):
        depth = 8.466 + 1.534 - begin.imag
        assert 5 - begin.real == pytest.approx(depth * math.tan(math.radians(30)))
        assert straight.end == pytest.approx(complex(-23, begin.imag))
        assert straight.pitch == pytest.approx(2.5)
        assert out.end == pytest.approx(complex(-25, begin.imag + 2))
        assert out.pitch == pytest.approx(2.5 * math.sqrt(2))  # 2.5 along z
    assert cut[-1][0].imag - 0.0 == pytest.approx(8.466)
    assert found[-1].end == M20.start


def test_a_taper_keeps_the_lead_along_z() -> None:
    found = list(thread_passes(LatheThread(**{**vars(M20), "taper": -0.9375})))
    for before, one in pairwise(found):
        if one.pitch:
            along = one.end - before.end
            assert before.end.imag == pytest.approx(one.end.imag - 0.9375)
            assert one.pitch * abs(along.real) / abs(along) == pytest.approx(2.5)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"first": 0.0}, "first depth"), ({"first": 2.0}, "first depth"), ({"finish": 2.0}, "first depth"), ({"lead": 0.0}, "lead"),
        ({"springs": 0}, "lead"), ({"angle": 200.0}, "angle"), ({"chamfer": 40.0}, "chamfer"), ({"end": complex(5, 8)}, "room"),
        ({"first": 1e-4}, "passes"), ({"start": complex(5, 9)}, "crest"), ({"first": 1.5, "finish": 0.5}, "more than its height"),
    ],
)  # fmt: skip
def test_refused_threads(wrong: dict, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        list(thread_passes(LatheThread(**{**vars(M20), **wrong})))


@pytest.mark.parametrize("taper", [-0.9375, 0.0, 3.0])
def test_a_chamfer_is_as_long_along_z_as_it_says(taper: float) -> None:
    """The cut is left 2 mm before its end in z and at 45 degrees, on tapered threads too, and on the line of the thread till then."""
    found = list(thread_passes(LatheThread(**{**vars(M20), "taper": taper, "chamfer": 2.0})))
    cuts = [k for k, one in enumerate(found) if one.pitch > 0.0]
    for begin, leave, out in zip(
        (found[k - 1] for k in cuts[::2]), *((found[k] for k in cuts[n::2]) for n in (0, 1)), strict=True
    ):
        assert leave.end.real - M20.end.real == pytest.approx(2.0)
        away = out.end - leave.end
        assert away == pytest.approx(complex(-2.0, 2.0))
        cut = leave.end - begin.end
        end = (
            begin.end + cut * (M20.end.real - begin.end.real) / cut.real
        )  # where the thread would end without it
        assert begin.end.imag - end.imag == pytest.approx(taper)
