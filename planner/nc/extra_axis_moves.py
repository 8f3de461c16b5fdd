"""Axes beside x, y and z: rotary A B C in degrees, and U V W, which are linear too, in mm. They are joints: no kinematics.

A machine that has one gives its letter to programs. Its coordinates follow the rules of the others, without rotation of the work system
and without tool offsets:

    machine position = origin of the work system + G92 offset + programmed coordinate

F goes as in RS274NGC: it is the speed of x, y and z together if one of them moves, else that of u, v and w, else that of the rotary
axes, in degrees per minute. A wrapped rotary axis (LinuxCNC's WRAPPED_ROTARY) goes in absolute mode to the programmed place within a
turn, forwards if the number is positive (0 included), backwards if it has a minus; after G53 too, where LinuxCNC takes the magnitude of
the number less the offsets (rs274ngc/interp_find.cc, find_ends and unwrap_rotary).
"""

from __future__ import annotations

import math

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc.block import Block, WordFault
from planner.nc.extra_axes import LETTERS, ROTARY
from planner.nc.state import State

_TURN = 360.0  # degrees


def _zeros() -> FloatArray:
    return np.zeros(len(LETTERS))


def refuse(state: State, block: Block, where: str) -> None:
    """Raise WordFault for a further axis in a place that does not know them."""
    if block.has(state.further.letters):
        word = block.first_of(state.further.letters)
        letter = next(c for c in state.further.letters if block.at.get(c) == word)
        raise WordFault(
            word, f"{letter} {where} is not supported; x, y and z are: write {letter} on a line of its own"
        )


def move(state: State, block: Block) -> None:
    """Move the further axes to where the words of a block lead. Raises WordFault for a place of a wrapped axis beyond a turn."""
    further = state.further
    in_machine = block.g.get("one-shot") == 530
    offset = _zeros() if in_machine else further.offset(state.system)
    for column in further.columns:
        letter = LETTERS[column]
        if letter not in block.value:
            continue
        value, here = block.value[letter] * scale(state, column), float(further.position[column])
        if not state.absolute and not in_machine:
            further.position[column] = here + value
        elif letter in further.wrapped:
            if abs(value) >= _TURN:
                raise WordFault(
                    block.at[letter],
                    f"axis {letter} is wrapped: its places are above -360 and below 360 degrees",
                )
            zero = further.offset(state.system)[column]
            place = abs(value - zero if in_machine else value)
            further.position[column] = _unwrapped(math.copysign(place, value), here - zero) + zero
        else:
            further.position[column] = value + offset[column]


def _unwrapped(value: float, here: float) -> float:
    """The place `value` [degrees] within a turn, ahead of `here` in the direction of its sign."""
    place = abs(value) + math.floor(here / _TURN) * _TURN
    forwards = math.copysign(1.0, value) > 0
    if forwards and place < here:
        return place + _TURN
    return place - _TURN if not forwards and place > here else place


def scale(state: State, column: int) -> float:
    """Degrees or mm of a programmed unit."""
    return 1.0 if column < ROTARY else state.unit


def shift_origin(state: State, block: Block, code: int) -> None:
    """G52 and G92 with words of further axes, and G92.1 to G92.3 for all of them."""
    further = state.further
    if code not in (520, 920):
        further.g92 = further.g92_saved.copy() if code == 923 else _zeros()
        if code == 921:
            further.g92_saved = _zeros()
        return
    origin = further.origins.get(state.system, _zeros())
    for column in further.columns:
        letter = LETTERS[column]
        if letter in block.value:
            value = block.value[letter] * scale(state, column)
            further.g92[column] = value if code == 520 else further.position[column] - origin[column] - value
    further.g92_saved = further.g92.copy()


def set_system(state: State, block: Block, code: int, *, from_place: bool) -> None:
    """G10 L2 (`from_place` False) and L20: the origin of a work system."""
    further = state.further
    origin = further.origins.get(code, _zeros()).copy()
    for column in further.columns:
        letter = LETTERS[column]
        if letter in block.value:
            value = block.value[letter] * scale(state, column)
            origin[column] = further.position[column] - further.g92[column] - value if from_place else value
    further.origins[code] = origin


def go_home(state: State, block: Block, code: int, *, everything: bool) -> None:
    """The further axes of the block, or all, go to the position of G28 or G30."""
    further = state.further
    home = further.homes.get(code, _zeros())
    for column in further.columns:
        if everything or LETTERS[column] in block.value:
            further.position[column] = home[column]


def length_moved(state: State, start: FloatArray, xyz: float) -> float:
    """The length that F and inverse time go by [mm; where only rotary axes move, degrees times the programmed unit].

    start : (6,) of the further axes before the move;  xyz : length of the path of x, y and z [mm]
    """
    if xyz > 0.0 or not state.further.letters:
        return xyz
    moved = state.further.position - start
    parallel = float(np.linalg.norm(moved[ROTARY:]))
    return parallel if parallel > 0.0 else float(np.linalg.norm(moved[:ROTARY])) * state.unit
