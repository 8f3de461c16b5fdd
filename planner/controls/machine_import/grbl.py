"""grbl's settings, as `$$` prints them: $110-$115 largest rates [mm/min], $120-$125 accelerations [mm/s2],
$11 junction deviation [mm], $130-$135 travel [mm], always in mm ($13 is the unit of reports)."""

import re

from planner.base.units import SECONDS_PER_MINUTE
from planner.controls.machine_import.settings import ControlSettings, Setting, Settings, Sourced
from planner.machine import LINEAR_AXES, ROTARY_AXES

_SETTING = re.compile(r"^\s*(\$\d+)\s*=\s*([^\s(;]+)", re.MULTILINE)
_LETTERS = "".join((*LINEAR_AXES, *ROTARY_AXES))


def recognised(text: str) -> bool:
    """Whether a text holds settings of grbl."""
    return len(_SETTING.findall(text)) >= 2


def settings(text: str, source: str) -> ControlSettings:
    """The settings that `$$` printed. Raises InputError for numbers that cannot be read."""
    given = Settings("{key}")
    for found in _SETTING.finditer(text):
        line = text.count("\n", 0, found.start(1)) + 1
        given.add("", found.group(1), Setting(found.group(2), source, line))
    given.counts_last()
    ends = {letter: given.number("", f"$13{k}") for k, letter in enumerate(_LETTERS)}
    travel = {  # machine coordinates of grbl end at 0
        letter: (Sourced(-abs(end.value), end.place), Sourced(0.0, f"{end.place}: it ends at 0"))
        for letter, end in ends.items()
        if end and end.value
    }
    deviation, laser, bounded = (given.number("", key) for key in ("$11", "$32", "$20"))
    notes = []
    if travel and bounded and not bounded.value:
        travel = {}
        said = "$20 is 0, no soft limits: travel is left out, $130 and so on may be those of grbl's delivery"
        notes.append(said)
    if laser and laser.value:
        notes.append("$32, laser mode, is left out: M4 and S words change no times here")
    return ControlSettings(
        control="grbl",
        velocity=dict(given.limits(_LETTERS, "$11{axis}", 1.0 / SECONDS_PER_MINUTE)),
        acceleration=dict(given.limits(_LETTERS, "$12{axis}")),
        law={"junction_deviation": deviation and deviation._replace(value=abs(deviation.value))},
        travel=travel,
        notes=tuple(notes),
    )
