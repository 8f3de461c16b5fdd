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
    feed_max     : largest feed along the path [mm/s], where the control has one
    dt           : interpolation period [s], where it is said
    tolerance    : of G64 P [mm], where a start-up code has one
    path_control : "blend", "exact_path" or "exact_stop", where a start-up code has one
    modes        : vibration modes that the control suppresses
    notes        : what of the settings has no counterpart in a machine file, one sentence each
    """

    control: str
    velocity: Mapping[str, Sourced]
    acceleration: Mapping[str, Sourced]
    jerk: Mapping[str, Sourced] = field(default_factory=dict)
    feed_max: Sourced | None = None
    dt: Sourced | None = None
    tolerance: Sourced | None = None
    path_control: str | None = None
    modes: tuple[FoundMode, ...] = ()
    notes: tuple[str, ...] = ()


def least(*found: Sourced | None) -> Sourced | None:
    """The smallest of some numbers; None where there is none."""
    known = [one for one in found if one is not None]
    return min(known, key=lambda one: one.value) if known else None
