"""The planners of grbl 1.1 and Marlin 2.1 block by block, with their ring buffers, and Klipper's own code: what
`control_times` holds the models of `planner time` against.

grbl and Marlin are written down from their sources (grbl/planner.c; Marlin/src/module/planner.cpp): a block is planned when it
is taken into the buffer, backwards and forwards over the blocks that are there, and the oldest is executed when the buffer is
full or nothing more comes. Klipper's is klippy/toolhead.py itself, from a copy of its sources, with everything but its look-ahead
queue left out. The limits of the axes are those of the machine; lines arrive as fast as they are taken.
"""

from __future__ import annotations

import math
import sys
import types
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np

BUFFER = 16  # BLOCK_BUFFER_SIZE of both: one place stays free
LEAST_SPEED = {"grbl": 0.0, "marlin": 0.05}  # MINIMUM_JUNCTION_SPEED, MINIMUM_PLANNER_SPEED [mm/s]
TURN_BACK = 0.999999  # cosine from which a corner counts as turning back, or its negative as straight [-]
SMALL_MM, SMALL_COSINE = 1.0, -math.sqrt(0.5)  # Marlin's "small segments"


class Block:
    """A block in the buffer: squares of speeds in mm2/s2."""

    __slots__ = ("accel", "entry", "length", "most", "nominal", "way")

    def __init__(self, way: np.ndarray, length: float, accel: float, nominal: float):
        self.way, self.length, self.accel, self.nominal = way, length, accel, nominal
        self.most = self.entry = 0.0

    def seconds(self, leave: float) -> float:
        """How long it takes to the square of a speed at its end [s]."""
        top = min(self.nominal**2, 0.5 * (self.entry + leave) + self.accel * self.length)
        top = max(top, self.entry, leave)
        ways = (top - self.entry) / (2 * self.accel), (top - leave) / (2 * self.accel)
        v = math.sqrt(top)
        ramps = (2 * v - math.sqrt(self.entry) - math.sqrt(leave)) / self.accel
        return ramps + max(self.length - sum(ways), 0.0) / v if v else 0.0


def buffered(
    name: str, points: np.ndarray, feed: np.ndarray, stop: np.ndarray, limits: dict[str, Any]
) -> float:
    """Time of a polyline on grbl or Marlin [s].

    limits : "velocity" and "acceleration" of the axes, "along" the largest acceleration of the path, "deviation", or "jump" by axis
    """
    total, ring = 0.0, deque()
    last: Block | None = None
    acceleration = limits["acceleration"]

    def execute() -> float:
        block = ring.popleft()
        leave = ring[0].entry if ring else 0.0
        lasts = block.seconds(leave)
        if ring:
            ring[0].most = ring[0].entry  # its speed is fixed now
        return lasts

    for begin, end, f, stands in zip(points, points[1:], feed, stop, strict=False):
        step = end - begin
        length = math.sqrt(float(step @ step))
        if stands:
            while ring:
                total += execute()
            last = None
        if length == 0.0:
            continue
        way = step / length
        with np.errstate(divide="ignore"):
            accel = min(float((acceleration / abs(way)).min()), limits["along"])
            block = Block(way, length, accel, min(f, float((limits["velocity"] / abs(way)).min())))
        if last is not None:
            block.most = min(_junction(name, last, block, limits), block.nominal**2, last.nominal**2)
        if len(ring) == BUFFER - 1:
            total += execute()
        ring.append(block)
        _plan(ring, LEAST_SPEED[name] ** 2)
        last = block
    while ring:
        total += execute()
    return total


def _plan(ring: deque[Block], least: float) -> None:
    """Backwards from rest behind the newest block, then forwards; the oldest begins as it does."""
    leave = least
    for k in range(len(ring) - 1, 0, -1):
        block = ring[k]
        entry = min(block.most, leave + 2 * block.accel * block.length)
        if entry == block.entry and k < len(ring) - 1:
            break  # nothing changes before it
        block.entry = leave = entry
    for k in range(len(ring) - 1):
        block, after = ring[k], ring[k + 1]
        after.entry = min(after.entry, block.entry + 2 * block.accel * block.length)


def _junction(name: str, last: Block, block: Block, limits: dict[str, Any]) -> float:
    """Square of the speed from one block to the next."""
    least = LEAST_SPEED[name] ** 2
    if name == "marlin" and limits.get("jump") is not None:
        return _classic(last, block, limits["jump"])
    cosine = -float(last.way @ block.way)
    if cosine > TURN_BACK:
        return least
    if cosine < -TURN_BACK and name == "grbl":
        return math.inf
    across = block.way - last.way
    size = float(np.linalg.norm(across))
    if size == 0.0:
        return math.inf
    along = min(block.accel, limits["along"]) if name == "marlin" else math.inf
    with np.errstate(divide="ignore"):
        accel = min(float((limits["acceleration"] / abs(across / size)).min()), along)
    sine = math.sqrt(0.5 * (1 - cosine))
    found = accel * limits["deviation"] * sine / (1 - sine) if sine < 1 else math.inf
    if name == "marlin" and block.length < SMALL_MM and cosine < SMALL_COSINE:
        found = min(found, accel * block.length / max(math.pi - math.acos(max(cosine, -1.0)), 1e-9))
    return max(found, least)


def _classic(last: Block, block: Block, jump: np.ndarray) -> float:
    """The square of the speed by the jump that each axis may have."""
    shared = min(last.nominal, block.nominal)
    speed, limited = shared, 1.0
    for leave, enter, most in zip(last.way * shared, block.way * shared, jump, strict=True):
        u, w = leave * limited, enter * limited
        change = max(abs(u), abs(w)) if u * w < 0 else abs(u - w)
        if change > most:
            limited *= most / change
    speed = shared * limited
    safe = [
        min([one.nominal, *(j / abs(u) for u, j in zip(one.way, jump, strict=True) if u)])
        for one in (last, block)
    ]
    return (safe[1] if min(safe) > 0.99 * speed else speed) ** 2


class KlipperPath:
    """Klipper's look-ahead (klippy/toolhead.py in `folder`) with limits: max_velocity, max_accel, z_velocity, z_accel, corner."""

    def __init__(self, folder: Path, limits: dict[str, float]):
        package = types.ModuleType("klippy")
        package.__path__ = []  # a package
        names = {"klippy": package, "klippy.kinematics": types.ModuleType("klippy.kinematics")}
        names |= {
            f"klippy.{one}": types.ModuleType(f"klippy.{one}")
            for one in ("mcu", "chelper", "kinematics.extruder")
        }
        names["klippy.kinematics"].__path__ = []
        sys.modules.update(names)
        for name, module in names.items():
            if "." in name:
                parent, _, child = name.rpartition(".")
                setattr(names[parent], child, module)
        code = types.ModuleType("klippy.toolhead")
        code.__package__ = "klippy"
        exec(compile((folder / "toolhead.py").read_text(), "toolhead.py", "exec"), vars(code))
        self.code, self.limits, self.seconds = code, limits, 0.0
        self.max_velocity, self.max_accel = limits["max_velocity"], limits["max_accel"]
        self.max_accel_to_decel = 0.5 * self.max_accel
        self.junction_deviation = limits["corner"] ** 2 * (math.sqrt(2) - 1) / self.max_accel
        self.extruder = self

    def calc_junction(self, before: Any, move: Any) -> float:
        """Of the extruder: none."""
        return float(move.max_cruise_v2)

    def _process_moves(self, moves: list[Any]) -> None:
        self.seconds += sum(move.accel_t + move.cruise_t + move.decel_t for move in moves)

    def time(self, points: np.ndarray, feed: np.ndarray, stop: np.ndarray) -> float:
        """Of a polyline [s]."""
        queue = getattr(self.code, "LookAheadQueue", None) or self.code.MoveQueue
        queue, self.seconds = queue(self), 0.0
        queue.set_flush_time(2.0)
        for begin, end, f, stands in zip(
            points.tolist(), points[1:].tolist(), feed.tolist(), stop, strict=False
        ):
            if stands:
                queue.flush()
            if begin == end:
                continue
            move = self.code.Move(self, [*begin, 0.0], [*end, 0.0], f)
            if move.axes_d[2]:
                ratio = move.move_d / abs(move.axes_d[2])
                move.limit_speed(self.limits["z_velocity"] * ratio, self.limits["z_accel"] * ratio)
            queue.add_move(move)
        queue.flush()
        return self.seconds
