"""Threads, cut in step with the spindle. From rest the feed F is reached behind a run-in of the length

    d = F T / 2,     T = F / a + a / j  where F >= a^2 / j,  else 2 sqrt(F / j),

a and j what the axes allow along the straight move; as long is the run-out. (The jerk-limited step to F: the
speed is symmetric about its middle, so its mean is F / 2.) A move of the length l holds its feed over l - 2
d.
"""

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.units import SECONDS_PER_MINUTE
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine


def run_in(toolpath: Toolpath, machine: Machine) -> FloatArray:
    """(M,) d of every segment at its feed, taken as straight [mm]; 0 where nothing is to be held."""
    found = np.zeros(len(toolpath))
    held = np.flatnonzero(toolpath.held)
    if not len(held):
        return found
    along = np.abs(toolpath.tangent_start[held])
    with np.errstate(divide="ignore"):
        a, j = (
            (machine.limits(name, toolpath.axes) / along).min(axis=1) for name in ("acceleration", "jerk")
        )
    feed = toolpath.feed[held]
    time = np.where(feed >= a * a / j, feed / a + a / j, 2.0 * np.sqrt(feed / j))
    found[held] = 0.5 * feed * time
    return found


def require_room(toolpath: Toolpath, machine: Machine) -> None:
    """Raise InputError for a thread whose feed the machine has not, or no move has room to reach."""
    held = np.flatnonzero(toolpath.held)
    if not len(held):
        return
    along = np.abs(toolpath.tangent_start[held])
    with np.errstate(divide="ignore"):
        fastest = (machine.limits("velocity", toolpath.axes) / along).min(axis=1)
    fastest = np.minimum(fastest, machine.feed_max or np.inf)
    slow = held[toolpath.feed[held] > fastest]
    if len(slow):
        k = int(slow[0])
        raise _refusal(
            toolpath,
            k,
            f"the machine allows F{SECONDS_PER_MINUTE * fastest[held == k][0]:.6g} there; take a smaller S",
        )
    need = 2.0 * run_in(toolpath, machine)
    for cut in np.split(held, np.flatnonzero(_parted(toolpath, held))):
        longest = int(cut[np.argmax(toolpath.length[cut] - need[cut])])
        if toolpath.length[longest] <= need[longest]:
            raise _refusal(
                toolpath,
                longest,
                f"run-in and run-out take {need[longest]:.6g} mm of its {toolpath.length[longest]:.6g} mm; start further away, "
                "or take a smaller S",
            )


def _parted(toolpath: Toolpath, held: np.ndarray) -> np.ndarray:
    """(n,) True where a cut begins among `held` (n,) but the first: behind another move or a stop."""
    parted = np.append(False, np.diff(held) > 1) | (toolpath.joint[held] == Joint.STOP)
    parted[0] = False
    return parted


def _refusal(toolpath: Toolpath, k: int, why: str) -> InputError:
    feed = SECONDS_PER_MINUTE * toolpath.feed[k]
    text = f"a thread is cut at F{feed:.6g} (pitch times S): {why}"
    return InputError(text, source=toolpath.source, line=int(toolpath.line[k]))
