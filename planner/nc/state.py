"""The modal state of the interpreter, and where the offsets put a coordinate.

    machine position = programmed coordinate * unit + G5x offset + G92 offset + tool length (z only)

All lengths are kept in mm and all positions in machine coordinates, so that changing an offset moves nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import MM_PER_INCH
from planner.machine import LINEAR_AXES, Machine
from planner.nc.program import PathControl

NO_MOTION = -1  # no motion code in force: at the start, and after G80
REFUSED_MOTION = -2  # a motion code that is not supported is in force (only `info` reads on)

_PATH_CONTROL = {
    "blend": PathControl.BLEND,
    "exact_path": PathControl.EXACT_PATH,
    "exact_stop": PathControl.EXACT_STOP,
}
_SYSTEMS = {f"g{n}": 10 * n for n in range(54, 60)} | {"g59.1": 591, "g59.2": 592, "g59.3": 593}


@dataclass(slots=True)
class State:
    """Modal state; starts as RS274NGC does: G21 G90 G17 G94 G40 G49 G54 G91.1 and no motion code.

    motion       : 0 ... 3, NO_MOTION or REFUSED_MOTION
    normal       : index of the axis normal to the arc plane
    unit         : mm per programmed length unit
    feed         : [mm/s], 0 where none has been given
    tolerance    : P of G64 [mm], NaN where none
    position     : (3,) machine position [mm]
    offset       : (3,) sum of the offsets below [mm]
    g92_saved    : what G92.3 brings back [mm]
    tool_length  : in force (G43) [mm]
    """

    motion: int = NO_MOTION
    normal: int = 2
    unit: float = 1.0
    absolute: bool = True
    absolute_centre: bool = False
    feed: float = 0.0
    path_control: PathControl = PathControl.BLEND
    tolerance: float = np.nan
    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    offset: FloatArray = field(default_factory=lambda: np.zeros(3))
    system: int = 540
    g92: FloatArray = field(default_factory=lambda: np.zeros(3))
    g92_saved: FloatArray = field(default_factory=lambda: np.zeros(3))
    tool_length: float = 0.0
    tool_selected: int = 0
    tool_loaded: int = 0


@dataclass(frozen=True)
class Setup:
    """What the machine says about a program: offsets, positions and tools, all zero without a machine; a feed [mm/s] where the program
    gives none."""

    path_control: PathControl = PathControl.BLEND
    systems: dict[int, FloatArray] = field(default_factory=dict)
    positions: dict[int, FloatArray] = field(default_factory=dict)
    tools: dict[int, float] = field(default_factory=dict)
    feed_default: float | None = None

    @classmethod
    def of(cls, machine: Machine | None) -> Setup:
        """A machine's setup; None for no machine."""
        if machine is None:
            return cls()
        return cls(
            path_control=_PATH_CONTROL[machine.path_control],
            systems={_SYSTEMS[name]: _vector(given) for name, given in machine.work_offsets.items()},
            positions={280 if name == "g28" else 300: _vector(p) for name, p in machine.positions.items()},
            feed_default=machine.feed_default,
            tools={int(tool): length for tool, length in machine.tools.items()},
        )

    def start(self) -> State:
        """The modal state at the start of a program."""
        state = State(path_control=self.path_control)
        self.apply_offsets(state)
        return state

    def apply_offsets(self, state: State) -> None:
        """Sum the offsets in force into `state.offset`."""
        state.offset[:] = state.g92
        if state.system in self.systems:
            state.offset += self.systems[state.system]
        state.offset[2] += state.tool_length


def set_units(state: State, code: int) -> None:
    """G20 (code 200): inches, G21: millimetres, from here on."""
    state.unit = MM_PER_INCH if code == 200 else 1.0


def _vector(given: dict[str, float]) -> FloatArray:
    return np.array([given.get(letter, 0.0) for letter in LINEAR_AXES])
