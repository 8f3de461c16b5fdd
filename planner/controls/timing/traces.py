"""What a recorded trace tells of a machine: how fast its axes run, speed up, and build up acceleration.

Read are samples t, x, y, z as CSV, halscope's log of LinuxCNC (";" between columns, "# Sampling period is N ns" at the
head, or the older one with a name before each number), and Klipper's motion log (scripts/motan/data_logger.py: messages
in JSON, packed; trapq:toolhead has pieces of constant acceleration).

Noise of a micrometre at 1 kHz is 2.4 m/s2 in second differences and 4.5e3 m/s3 in third ones, so nothing is differentiated twice.
Each stroke of an axis, from one standstill or reversal to the next, is held against the motion that limits of velocity,
acceleration and jerk give, which is that of a step D behind three moving averages as long as T1 >= T2 >= T3:

    x(t) = x0 + D / (T1 T2 T3) sum over the subsets S of {T1, T2, T3} of (-1)^|S| (t - t0 - sum S)_+^3 / 6

so that its peaks are D/T1, D/(T1 T2) and D/(T1 T2 T3). Least squares over the samples; strokes of another shape, those of
motions that turn corners, are left out. A limit is what the fastest strokes that have a plateau at it agree upon.
"""

from __future__ import annotations

import gzip
import itertools
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.machine import ALL_AXES, Machine, machine_from_dict

PERIOD = 0.001  # of the samples that Klipper's pieces become [s]
LEAST = 32  # samples of a stroke
STILL = 0.02  # of the highest speed: slower is taken for standing
WINDOW = 15  # samples, of the smoothed speed that finds strokes
MOST = 40  # strokes that are looked at, of each axis
LIKE = 1e-3  # of its length: how far a stroke may be from its shape, rms, beyond the noise
PLATEAU = 1.1  # how much longer one average must be than the next, for a plateau at its limit
SURE = 4.0  # standard deviations of a time that is known
AGREE = 0.9  # strokes that are as fast as this share of the 90th percentile agree on a limit
STARTS = (0.7, 0.25, 0.05), (0.5, 0.3, 0.2), (0.5, 0.48, 0.02)  # T1, T2, T3 of a stroke's time, to begin with
_PERIOD = re.compile(r"#?\s*Sampling period is (\d+) n", re.IGNORECASE)
_AXIS = re.compile(
    r"(?:.*?(?:axis|joint)[._])?([xyzabcuvw]|\d)(?:[._ -]*(?:motor[._-])?pos.*|\s*\[?(?:mm|deg)?\]?)"
)


@dataclass(frozen=True, kw_only=True)
class Trace:
    """t : (T,) times [s]; position : (T,) of each axis [mm, deg]; source : the file"""

    t: FloatArray
    position: dict[str, FloatArray]
    source: str

    @property
    def seconds(self) -> float:
        """From where the motion begins to where it ends [s]. Raises InputError where nothing moves."""
        ends = [(first, last) for x in self.position.values() for first, last in _moving(self.t, x)]
        if not ends:
            raise InputError("nothing moves in this trace", source=self.source)
        first, last = min(a for a, _ in ends), max(b for _, b in ends)
        return float(self.t[last] - self.t[first])


def read_trace(path: str | Path) -> Trace:
    """A trace from a file. Raises InputError naming file and line for what is none."""
    source = str(path)
    try:
        data = Path(path).read_bytes()
        if data[:2] == b"\x1f\x8b":
            data = gzip.decompress(data)
    except (OSError, EOFError) as fault:
        raise InputError(f"the file cannot be read: {fault}", source=source) from fault
    if b"\0" in data:
        said = "a binary file; a trace is CSV, a log of halscope or Klipper's motion log"
        raise InputError(said, source=source)
    if data.lstrip()[:1] == b"{":
        return _of_klipper(data, source)
    lines = data.decode("utf-8", errors="replace").splitlines()
    period = _PERIOD.match(lines[0]) if lines else None
    first = next((k for k in range(1 if period else 0, len(lines)) if lines[k].strip()), None)
    if first is None:
        raise InputError("the trace is empty", source=source)
    mark = next((c for c in ";\t," if c in lines[first]), None)
    names, columns = lines[first].split(mark), None
    if mark is None:  # the older halscope has a name before each number
        names, columns = names[::2], range(1, len(names), 2)
    else:
        first += 1
    try:
        table = np.loadtxt(lines[first:], delimiter=mark, usecols=columns, ndmin=2)
    except ValueError as fault:
        row = re.search(r"at row (\d+)", str(fault))  # which numpy counts from 1
        line = first + int(row[1]) + ("changed" not in str(fault)) if row else None
        raise InputError(re.split(";| at row", str(fault))[0], source=source, line=line) from None
    if len(table) < LEAST or table.shape[1] != len(names):
        said = f"{len(table)} samples of {table.shape[1]} numbers and {len(names)} names"
        raise InputError(f"{said}; at least {LEAST} are needed, with a name for each number", source=source)
    return _of_columns([name.strip().strip('"').lower() for name in names], table, period, source)


def _of_columns(names: list[str], table: FloatArray, period: re.Match[str] | None, source: str) -> Trace:
    """The trace of columns by their names; `period` is that of halscope, which has no times."""
    position: dict[str, FloatArray] = {}
    for k, name in enumerate(names):
        if found := _AXIS.fullmatch(name):
            letter = ALL_AXES[int(found[1])] if found[1].isdigit() else found[1]
            position.setdefault(letter, table[:, k])
    times = [k for k, name in enumerate(names) if re.fullmatch(r"(t|time)\s*[\[(]?m?s?[\])]?", name)]
    if not position or not (times or period):
        missing = "no column of an axis" if not position else "no column t"
        needed = "t [s] and x, y, ... [mm], or of halscope joint.0.motor-pos-cmd or axis.x.pos-cmd"
        said = f"{missing}; found are {', '.join(names)}; needed are {needed}"
        raise InputError(said, source=source, line=1)
    unit = 1e-9 * int(period[1]) if period else 1e-3 if "ms" in names[times[0]] else 1.0
    t: FloatArray = (np.arange(len(table), dtype=np.float64) if period else table[:, times[0]]) * unit
    if late := np.flatnonzero(np.diff(t) <= 0.0).tolist():
        raise InputError(f"sample {late[0] + 2}: times must increase", source=source)
    return Trace(t=t, position=position, source=source)


def _of_klipper(data: bytes, source: str) -> Trace:
    """The trace of a motion log: pieces (time, duration, speed, acceleration, place, direction)."""
    try:
        messages = [json.loads(part) for part in data.split(b"\x03") if part.strip()]
        moves = [one.get("params", one)["data"] for one in messages if one.get("q") == "trapq:toolhead"]
        pieces = [row for data in moves for row in data]
        begin, lasts, speed, accel = np.array([row[:4] for row in pieces], dtype=np.float64).reshape(-1, 4).T
        place, way = (np.array([row[k] for row in pieces], dtype=np.float64) for k in (4, 5))
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as fault:
        raise InputError(f"no motion log of Klipper: {fault}", source=source) from None
    if not len(begin):
        raise InputError("no trapq:toolhead in this log: nothing of the motion was recorded", source=source)
    t = np.arange(begin[0], begin[-1] + lasts[-1] + PERIOD, PERIOD)
    k = np.maximum(np.searchsorted(begin, t, side="right") - 1, 0)
    since = np.clip(t - begin[k], 0.0, lasts[k])
    gone = (speed[k] + 0.5 * accel[k] * since) * since
    at = place[k] + way[k] * gone[:, None]
    return Trace(t=t - t[0], position=dict(zip("xyz", at.T, strict=False)), source=source)


def _noise(x: FloatArray) -> float:
    """Standard deviation of the noise of samples (T,), by their third differences: 1 + 9 + 9 + 1 of its square [mm]."""
    return float(1.4826 * np.median(np.abs(np.diff(x, 3))) / np.sqrt(20.0)) if len(x) > 3 else 0.0


def _moving(t: FloatArray, x: FloatArray) -> list[tuple[int, int]]:
    """First and last sample of the strokes of an axis: of one sign of its speed."""
    if len(x) < LEAST:
        return []
    from scipy.signal import savgol_filter  # 0.2 s

    period = float(np.median(np.diff(t)))
    speed = savgol_filter(x, WINDOW, 2, deriv=1, delta=period)  # by parabolas
    top, sd = float(np.abs(speed).max()), np.sqrt(12.0 / WINDOW**3) * _noise(x) / period
    if top <= 2.0 * SURE * sd or np.ptp(x) <= 0.0:
        return []
    way = np.where(np.abs(speed) > max(STILL * top, SURE * sd), np.sign(speed), 0.0)
    ends = np.flatnonzero(np.diff(way)) + 1
    runs = itertools.pairwise([0, *ends.tolist(), len(x)])
    return [(first, last - 1) for first, last in runs if way[first] != 0.0 and last - first > LEAST // 4]


def limits_of(
    traces: Sequence[Trace], machine: Machine
) -> tuple[Machine, tuple[tuple[str, float, float], ...], list[str]]:
    """The machine with the limits of its axes that traces show, these (name, before, found), and what they do not show, one
    sentence each. Raises InputError where no axis has a stroke that can be used.

    A velocity is that of the fastest strokes that keep one: of rapids that are long enough it is the limit. A jerk, T3 =
    acceleration / jerk, may as well be a moving average of that length behind the control.
    """
    data, settings, said, seen = machine.model_dump(exclude_defaults=True), [], [], 0
    for letter, axis in machine.axes.items():
        parts = [strokes(one.t, one.position[letter]) for one in traces if letter in one.position]
        length, *times = np.concatenate([np.zeros((0, 4)), *parts]).T
        seen += len(length)
        of_speed, of_accel, ramp = times[0], times[1], np.nan_to_num(times[2])
        speed, accel = length / of_speed, length / (of_speed * of_accel)
        ramped = 2 * np.count_nonzero(ramp) > len(ramp)
        for name, values, plateau in (
            ("velocity", speed, of_speed > PLATEAU * (of_accel + ramp)),
            ("acceleration", accel, of_accel > PLATEAU * ramp),
            ("jerk", accel / np.where(ramp > 0.0, ramp, 1.0), (ramp > 0.0) & ramped),
        ):
            if plateau.any():
                data["axes"][letter][name] = value = _agreed(values[plateau])
                settings.append((f"{letter}.{name}", getattr(axis, name), value))
            elif len(length):
                value = getattr(axis, name)
                said.append(f"{letter}.{name} {value:g} stays: no stroke of the {len(length)} shows it")
    if not seen:
        text = "no axis goes straight from rest to rest, or to and fro, in what was recorded: record x.nc, y.nc, z.nc of --write"
        raise InputError(text, source=traces[0].source)
    return machine_from_dict(data), tuple(settings), said


def _agreed(values: FloatArray) -> float:
    """What the largest of values (n,) agree upon: single ones may be off."""
    return float(np.median(values[values >= AGREE * np.quantile(values, AGREE)]))


def strokes(t: FloatArray, x: FloatArray) -> FloatArray:
    """(n, 4) length of the strokes of an axis that have the shape of limits [mm], and T1 >= T2 >= T3 of them [s]; NaN for a
    T3 that the samples do not tell from nothing. Of times t and places x (T,) [s, mm]."""
    runs, noise = _moving(t, x), _noise(x)
    found = []
    for k in np.unique(np.linspace(0, len(runs) - 1, min(MOST, len(runs))).astype(int)) if runs else []:
        first, last = runs[k]
        room = LEAST + (last - first) // 4  # of the standstill on either side
        begin = max(runs[k - 1][1] + 1 if k else 0, first - room)
        end = min(runs[k + 1][0] if k + 1 < len(runs) else len(x), last + room)
        if end - begin >= LEAST:
            one = _stroke(t[begin:end] - t[first], x[begin:end], t[last] - t[first], noise)
            found += [one] if one else []
    return np.array(found).reshape(-1, 4)


def _stroke(t: FloatArray, x: FloatArray, lasts: float, noise: float) -> list[float] | None:
    """Length, T1, T2 and T3 of samples t, x (n,), with noise of a standard deviation, of a stroke that begins at about 0 and
    lasts; None for another shape."""
    from scipy.optimize import least_squares  # 0.3 s

    def linear(log: FloatArray) -> tuple[Array, Array]:
        shape = np.stack([np.ones_like(t), _shape(t - log[0], np.exp(log[1:]))], axis=1)
        return shape, np.linalg.lstsq(shape, x, rcond=None)[0]

    def off(log: FloatArray) -> FloatArray:
        shape, size = linear(log)
        left: FloatArray = x - shape @ size
        return left

    dt = float(np.median(np.diff(t)))
    for share in STARTS:
        done = least_squares(off, [0.0, *np.log(np.array(share) * lasts)], x_scale=[dt, 1, 1, 1], max_nfev=60)
        length = abs(float(linear(done.x)[1][1]))
        if np.sqrt(2.0 * done.cost / len(t)) <= 1.5 * noise + LIKE * length:
            break
    else:
        return None
    *longer, ramp = np.sort(np.exp(done.x[1:]))[::-1].tolist()
    variance = np.linalg.pinv(done.jac.T @ done.jac) * max(noise, 1e-9) ** 2
    unsure = SURE * float(np.sqrt(variance[k := 1 + int(np.argmin(done.x[1:])), k]))
    return [length, *longer, ramp if ramp > 1.5 * dt and unsure < 1.0 else np.nan]


def _shape(t: FloatArray, times: FloatArray) -> FloatArray:
    """(n,) a step behind three moving averages: 0 before, 1 after."""
    total = np.zeros_like(t)
    for taken in itertools.product((0.0, 1.0), repeat=3):
        sign = (-1.0) ** sum(taken)
        total += sign * np.maximum(t - np.dot(taken, times), 0.0) ** 3
    return total / (6.0 * np.prod(times))
