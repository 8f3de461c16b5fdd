"""The colours of the report and of figures in notebooks, told apart with red-green blindness too."""

from __future__ import annotations

from collections.abc import Sequence

# Okabe and Ito (2008), without black; then four of Paul Tol's muted scheme, for machines with many limits.
COLOURS = (
    "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#882255", "#44AA99", "#999933", "#332288",
)  # fmt: skip
GREY, LIGHT = "#8c8c8c", "#c4c4c4"
# Cividis, from low to high, at ten equal steps.
CIVIDIS = (
    "#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838",
)  # fmt: skip


def limit_colours(names: Sequence[str]) -> list[str]:
    """A colour for each limit: grey for "none" and "rest", the others in the order of the names."""
    others = [name for name in names if name not in ("none", "rest")]
    return [
        {"none": GREY, "rest": LIGHT}[name]
        if name in ("none", "rest")
        else COLOURS[others.index(name) % len(COLOURS)]
        for name in names
    ]
