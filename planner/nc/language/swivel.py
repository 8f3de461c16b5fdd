"""Tilted planes: CYCLE800 of Siemens, PLANE and cycle 19 of Heidenhain, on a machine with kinematics.

The plane's coordinates are p = d + M p', M a rotation; the tool is to stand along u = M e_z. The rotary axes
turn to one of the two pairs of angles for u (`machine/kinematics/chain.py`), as a rapid move of the joints, and
the tool centre point is switched on behind it, so that x, y, z are the tool's tip as seen from the workpiece.

    Siemens      the angles A, B, C about the axes of MODE, each about the axes turned before: M = R1 R2 R3; the zero
                 is at (X0, Y0, Z0), and (X1, Y1, Z1) further in the plane
    Fanuc        G68.2 X Y Z I J K: M = Rz(I) Rx(J) Rz(K), the zero at (X, Y, Z); G53.1 turns the axes, G69 ends it
    Heidenhain   M = Rz(SPC) Ry(SPB) Rx(SPA); EULER: M = Rz(EULPR) Rx(EULNU) Rz(EULROT); RELATIV: M Rx, Ry or Rz

Sources: 840D sl, CYCLE800 (bits of MODE); TNC 640, conversational programming, PLANE SPATIAL.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.units import RAD_PER_DEG
from planner.nc.language.makers import set_frame
from planner.nc.language.making import Given, Making
from planner.nc.language.rows import require, turned
from planner.nc.language.travel import Travel
from planner.nc.settings import TOOL_POINT_OFF, TOOL_POINT_ON

_ON, _OFF = float(TOOL_POINT_ON[1]), float(TOOL_POINT_OFF[1])
_SAME = 1e-9  # of a direction's components, which are the same then
NO_MOVE, _STAY, _TURN, _MOVE = 0, 1, 2, 3  # what the rotary axes do
WAYS = {"STAY": _STAY, "TURN": _TURN, "MOVE": _MOVE}
RETRACTED = "the retraction of CYCLE800 (FR), to places that the machine's data hold, is not planned"
MOVED = "PLANE with MOVE turns the rotary axes where the tool stands, as with TURN"


def siemens(making: Making, given: Given) -> None:
    """CYCLE800(FR, TC, ST, MODE, X0, Y0, Z0, A, B, C, X1, Y1, Z1, DIR ...), arguments as p0, p1 ... Raises
    ValueError."""
    mode = round(given.get("p3", 0.0))
    angles = [given.get(f"p{k}", 0.0) for k in (7, 8, 9)]
    before, behind = (np.array([given.get(f"p{k}", 0.0) for k in part]) for part in ((4, 5, 6), (10, 11, 12)))
    what = f"MODE {mode} of CYCLE800, angles of the rotary axes, solid or projection angles, is not read"
    require(not any(angles) or not mode >> 6, f"{what}; write angles axis by axis (MODE 57 or 27)")
    if round(given.get("p2", 0.0)) % 10 == 1:
        raise ValueError("ST 1 of CYCLE800, a plane on another one, is not read; write its angles from zero")
    if given.get("p0", 0.0) and len(given) > 1:
        making.assume(RETRACTED)
    matrix = np.eye(3)
    for k, angle in enumerate(angles):
        if angle:
            matrix = matrix @ turned(angle, (mode >> 2 * k & 3) - 1)
    shift = (before + matrix @ behind) * making.unit
    side = given.get("p13", -1.0)
    way = NO_MOVE if not given else _TURN if side else _STAY
    plane(making, matrix, shift, way, int(side) if any(angles) else 0)
    set_frame(making)


def heidenhain(making: Making, given: Given) -> None:
    """PLANE and cycle 19: SPA SPB SPC, EULPR EULNU EULROT; `way` one of WAYS, `side` of SEQ. Raises
    ValueError."""
    if "EULNU" in given:
        matrix = euler(given["EULPR"], given["EULNU"], given["EULROT"])
    else:
        parts = (turned(given.get(f"SP{'ABC'[k]}", 0.0), k) for k in (2, 1, 0))
        matrix = np.linalg.multi_dot(list(parts))
    _no_frame(making, matrix, np.zeros(3), turned_only=True)
    if "relative" in given:
        matrix = making.travel.swivelled[0] @ matrix
    if given["way"] == _MOVE:
        making.assume(MOVED)
    tilt(making, matrix, np.zeros(3), round(given["way"]), round(given.get("side", 0.0)))
    set_frame(making)


def euler(first: float, second: float, third: float) -> FloatArray:
    """The matrix (3, 3) of rotations about z, the new x and the new z [degrees]."""
    return np.asarray(turned(first, 2) @ turned(second, 0) @ turned(third, 2), dtype=np.float64)


def plane(making: Making, matrix: FloatArray, shift: FloatArray, way: int, side: int) -> None:
    """As `tilt`, shift (3,) [mm] and matrix (3, 3), on no programmed frame. Raises ValueError."""
    _no_frame(making, matrix, shift)
    tilt(making, matrix, shift, way, side)


def is_level(travel: Travel) -> bool:
    """True where no tilted plane is in force."""
    matrix, shift = travel.swivelled
    return not shift.any() and bool((matrix == np.eye(3)).all())


def _no_frame(making: Making, matrix: FloatArray, shift: FloatArray, *, turned_only: bool = False) -> None:
    """A plane on top of a programmed frame (with `turned_only` of more than a shift). Raises ValueError."""
    frame, moved = making.travel.programmed
    framed = (frame != np.eye(3)).any() or (bool(moved.any()) and not turned_only)
    if framed and (shift.any() or (matrix != np.eye(3)).any()):
        what = "a tilted plane while a frame (shift, rotation, mirror image, scale) is in force"
        raise ValueError(f"{what} is not read; end that first")


def tilt(making: Making, matrix: FloatArray, shift: FloatArray, way: int, side: int) -> None:
    """The plane p = shift + matrix p' is in force from here on, shift (3,) [mm] and matrix (3, 3). Raises
    ValueError without kinematics.

    side : sign of the tilting axis, 0 for the nearer pair of angles
    """
    travel, interpreter = making.travel, making.interpreter
    state, chain, direction = interpreter.state, interpreter.tool_point.chain, matrix[:, 2]
    level = bool(abs(direction - np.array([0.0, 0.0, 1.0])).max() < _SAME)
    if chain is None and not level:
        what = "a tilted plane turns the rotary axes of the machine, and its file has no table [kinematics]"
        raise ValueError(f"{what}; add it (type, rotary axes and their offsets)")
    travel.swivel(np.eye(3), np.zeros(3))
    if chain is None:
        travel.swivel(matrix, shift)
        return
    letters = [letter.upper() for letter in chain.data.rotary]
    at = [state.letters.index(letter) for letter in letters]
    here = state.programmed()[at]
    pairs = chain.angles(direction[None])[0] / RAD_PER_DEG
    fitting = [pair for pair in pairs if not side or level or np.sign(pair[0]) == side]
    target = min(fitting, key=lambda pair: float(abs(pair - here).max()))
    for k in range(2):
        making.numbered[120 + "ABC".index(letters[k]) + 1] = float(target[k])
    if way == NO_MOVE or (way != _STAY and abs(target - here).max() < _SAME):
        target = here
    making.take([[("M", _OFF)]])
    if way in (_TURN, _MOVE) and (target != here).any():
        making.take([[("G", 90.0), ("G", 0.0), *zip(letters, target.tolist(), strict=True)]])
        making.take([] if state.absolute else [[("G", 91.0)]])
    on = way != NO_MOVE and bool(abs(state.programmed()[at] - target).max() < _SAME) and not level
    if on:
        making.take([[("M", _ON)]])
    travel.swivel(matrix, shift, waiting=way == _STAY and not on and not level)
