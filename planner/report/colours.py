"""The colours of the report and of figures in notebooks, told apart with red-green blindness too."""

from __future__ import annotations

from collections.abc import Sequence

# Okabe and Ito (2008), without black; then, for machines with many limits and pages with many methods, the four that are farthest from
# all before them to people with and without red-green blindness, and seen on light and dark ground (tests/report/test_colours.py).
COLOURS = (
    "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#0000F0", "#901818", "#6060F0", "#30D878",
)  # fmt: skip
GREY, LIGHT = "#606060", "#c4c4c4"
INK, DIM = "#1d2430", "#667085"  # of text, and of what is beside it, on light ground
PRICES = (0.02, "#f6c667"), (0.5, "#e8743b"), (1.0, "#7a1f5c")  # share of the dearest [-], and its colour
# Cividis, from low to high, at ten equal steps.
CIVIDIS = (
    "#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838",
)  # fmt: skip
# The same where they have to be seen against a light or a dark page: without its bright or its dark end, at equal steps.
LOW_TO_HIGH = {
    "light": ("#00224e", "#3b496c", "#77766f", "#ad9650", "#d9a900"),
    "dark": ("#4a7ccc", "#6f86b0", "#9a978f", "#cdb969", "#fee838"),
}


def limit_colours(names: Sequence[str]) -> list[str]:
    """A colour for each limit: grey for "none" and "rest", the others in the order of the names."""
    others = [name for name in names if name not in ("none", "rest")]
    return [
        {"none": GREY, "rest": LIGHT}[name]
        if name in ("none", "rest")
        else COLOURS[others.index(name) % len(COLOURS)]
        for name in names
    ]
