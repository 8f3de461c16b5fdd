"""What the settings of a control say about a machine, each number with its place; and what they leave open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple


class Sourced(NamedTuple):
    """A number and where it stands in the settings, such as "$120" or "[AXIS_X] MAX_ACCELERATION"."""

    value: float
    place: str


class FoundMode(NamedTuple):
    """A vibration mode: frequency [Hz], damping ratio [-], and where it stands."""

    frequency: float
    damping: float
    place: str


@dataclass(frozen=True, kw_only=True)
class ControlSettings:
    """The settings of one control, in mm (degrees for rotary axes) and s.

    control      : its name
    velocity     : largest velocity by axis letter [mm/s]
    acceleration : largest acceleration by axis letter [mm/s2]
    jerk         : largest jerk by axis letter [mm/s3], where the control knows one
    wrapped      : letters of rotary axes whose places are within a turn
    feed_max     : largest feed along the path [mm/s], where the control has one
    dt           : interpolation period [s], where it is said
    tolerance    : of G64 P [mm], where a start-up code has one
    path_control : "blend", "exact_path" or "exact_stop", where a start-up code has one
    inch         : whether programs without G20 and G21 are in inches
    lathe        : whether it is a lathe whose programs have radii until G7
    law          : keys of the table [control] of a machine file, and what the control has for them
    corner_jump  : jump of velocity that a corner may have, by axis letter [mm/s], where the control has one
    kinematics   : keys of the table [kinematics] of a machine file; "type" is a text
    modes        : vibration modes that the control suppresses
    notes        : what of the settings has no counterpart in a machine file, one sentence each
    """

    control: str
    velocity: Mapping[str, Sourced]
    acceleration: Mapping[str, Sourced]
    jerk: Mapping[str, Sourced] = field(default_factory=dict)
    wrapped: str = ""
    feed_max: Sourced | None = None
    dt: Sourced | None = None
    tolerance: Sourced | None = None
    path_control: str | None = None
    inch: bool = False
    lathe: bool = False
    law: Mapping[str, Sourced | None] = field(default_factory=dict)
    corner_jump: Mapping[str, Sourced] = field(default_factory=dict)
    kinematics: Mapping[str, Sourced | str] = field(default_factory=dict)
    modes: tuple[FoundMode, ...] = ()
    notes: tuple[str, ...] = ()


def travel_note(travel: Mapping[str, tuple[float | None, float | None]]) -> str:
    """A sentence on how far the axes go, [mm] or degrees, which no machine file says; "" where the settings do not say it."""
    said = [
        f"{letter} {_end(low)} to {_end(high)}"
        for letter, (low, high) in travel.items()
        if low is not None or high is not None
    ]
    return f"travel is left out, and no plan is checked against it: {', '.join(said)}" if said else ""


def _end(value: float | None) -> str:
    return "?" if value is None else f"{value:.6g}"


def least(*found: Sourced | None) -> Sourced | None:
    """The smallest of some numbers; None where there is none."""
    known = [one for one in found if one is not None]
    return min(known, key=lambda one: one.value) if known else None
