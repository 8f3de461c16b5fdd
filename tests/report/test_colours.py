"""Colours as people with red-green blindness see them: simulated after Machado, Oliveira and Fernandes (2009), in linear sRGB."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from planner.report.figure import CIVIDIS, COLOURS, GREY, LIGHT, LOW_TO_HIGH

SEEN = {
    "by most": np.eye(3),
    "without green cones": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "without red cones": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
}
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
WHITE = XYZ.sum(axis=1)
PAGE = {"light": "#f6f7f9", "dark": "#1b212b"}  # panels of the report
# CIE 1976 differences: two colours side by side differ plainly from about 10 on.
APART, STEP = 16.0, 15.0


def linear(colour: str) -> np.ndarray:
    """Linear sRGB of "#rrggbb"."""
    share = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def lab(colour: str, seen: np.ndarray) -> np.ndarray:
    """CIE L*a*b* of a colour as it is seen."""
    xyz = XYZ @ np.clip(seen @ linear(colour), 0, 1) / WHITE
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), 841 / 108 * xyz + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(one: str, other: str) -> float:
    """Of two colours, as WCAG 2 has it [-]."""
    dark, light = sorted(float(XYZ[1] @ linear(colour)) for colour in (one, other))
    return (light + 0.05) / (dark + 0.05)


def test_white_black_and_grey_are_where_cie_has_them() -> None:
    for colour, lightness in (("#ffffff", 100.0), ("#000000", 0.0), ("#777777", 50.03)):
        assert lab(colour, SEEN["by most"]) == pytest.approx([lightness, 0.0, 0.0], abs=0.1)
    assert contrast("#ffffff", "#000000") == pytest.approx(21.0)


@pytest.mark.shows("pictures", "sampled: no peak is lost, colours are told apart")
@pytest.mark.parametrize("seen", SEEN)
def test_limits_and_methods_are_told_apart(seen: str) -> None:
    found = {
        (one, other): float(np.linalg.norm(lab(one, SEEN[seen]) - lab(other, SEEN[seen])))
        for one, other in itertools.combinations([*COLOURS, GREY, LIGHT], 2)
    }
    assert min(found.values()) > APART, min(found.items(), key=lambda item: item[1])


@pytest.mark.parametrize("seen", SEEN)
@pytest.mark.parametrize("scale", [CIVIDIS[::2], *LOW_TO_HIGH.values()], ids=["Cividis", *LOW_TO_HIGH])
def test_more_is_lighter_to_everybody(seen: str, scale: tuple[str, ...]) -> None:
    found = np.array([lab(colour, SEEN[seen]) for colour in scale])
    assert np.all(np.diff(found[:, 0]) > 0.0)
    assert np.linalg.norm(np.diff(found, axis=0), axis=1).min() > STEP


@pytest.mark.parametrize("ground", LOW_TO_HIGH)
def test_both_ends_of_a_scale_are_seen_on_the_page(ground: str) -> None:
    """Cividis from end to end has 1.2 on light, 1.0 on dark ground."""
    assert min(contrast(colour, PAGE[ground]) for colour in LOW_TO_HIGH[ground]) > 1.9
