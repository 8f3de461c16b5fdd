"""Random programs with what an export must not lose: machine coordinates, work offsets, first moves, tools, lasers, rotary axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.machine import Machine

AXIS = {"velocity": 300.0, "acceleration": 3000.0, "jerk": 60000.0}
TURN = {"velocity": 60.0, "acceleration": 300.0, "jerk": 6000.0}
TOLERANCE = 0.05  # of the plans [mm]
SYSTEMS = ("G54", "G55", "G56", "G57", "G58", "G59")
PLANES = {"G17": ("X", "Y", "I", "J"), "G18": ("X", "Z", "I", "K"), "G19": ("Y", "Z", "J", "K")}


def machine(*, rotary: bool = False) -> Machine:
    """A mill, with a rotary axis if asked for."""
    axes = {"x": AXIS, "y": AXIS, "z": AXIS} | ({"a": TURN} if rotary else {})
    return Machine(
        name="law",
        dt=0.002,
        tolerance=0.9 * TOLERANCE,
        feed_default=10.0,
        axes=axes,
        tools={"1": 12.0, "2": 7.5},
    )


@dataclass
class _State:
    rng: np.random.Generator
    unit: float = 1.0
    absolute: bool = True
    code: str = ""
    fed: bool = False
    plane: str = "G17"
    mild: bool = False

    def pick(self, *choices: str) -> str:
        return choices[int(self.rng.integers(len(choices)))]

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def length(self, low: float, high: float) -> str:
        value = self.rng.uniform(low, high) / self.unit
        return f"{value:.{2 if self.unit == 1.0 else 4}f}"


def random_program(seed: int) -> tuple[str, Machine]:
    """A program and a machine for it; four of ten are mild, with words that printers' controls have, too."""
    rng = np.random.default_rng(seed)
    state = _State(rng)
    rotary, laser, state.mild = state.chance(0.15), state.chance(0.2), state.chance(0.4)
    rotary, laser = rotary and not state.mild, laser and not state.mild
    lines = _start(state, laser=laser)
    for _ in range(int(rng.integers(4, 14))):
        lines += _step(state, rotary=rotary, laser=laser)
    lines += ["M5"] * state.chance(0.5) + [
        state.pick("G53 G0 Z0", "G91 G28 Z0", "G28", "G0 Z5")
    ] * state.chance(0.5)
    if lines[-1].startswith("G53") and not state.absolute:
        lines[-1] = "G90 " + lines[-1]
    lines += [state.pick("M2", "M30")] if state.chance(0.8) else []
    if state.chance(0.2):
        lines = [f"N{10 * k} {line}" if line[0] in "GMXYZTS" else line for k, line in enumerate(lines, 1)]
    return "\n".join([*lines, ""]), machine(rotary=rotary)


def _start(state: _State, *, laser: bool) -> list[str]:
    lines = ["%"] * state.chance(0.15) + ["O1234"] * state.chance(0.1) + ["(a job)"] * state.chance(0.3)
    if state.chance(0.2):
        state.unit = 25.4
        lines.append("G20 G90")
    elif state.chance(0.8):
        lines.append(state.pick("G21 G90 G17", "G21 G90", "G21", "G90 G21 G17 G94 G40 G49 G80"))
    if state.mild:
        lines += [state.pick("G54", "G28", "G92 X0 Y0 Z0")] * state.chance(0.5)
        return lines + _first(state)
    lines += [state.pick("G54", "G55", "G54")] * state.chance(0.4)
    lines += [state.pick("G53 G0 Z0", "G28", "G91 G28 Z0\nG90", "$H")] * state.chance(0.25)
    lines += [state.pick("T1 M6", "T2\nM6", "T1 M6\nG43 H1")] * state.chance(0.2)
    lines += (
        [state.pick("M4", "M3 S100", "M4 S0")]
        if laser
        else [state.pick("M3 S9000", "S8000 M3")] * state.chance(0.4)
    )
    lines += ["M8"] * state.chance(0.1)
    return lines + _first(state)


def _first(state: _State) -> list[str]:
    """The first moves, in the orders in which programs place their axes."""
    first = state.pick("xyz", "z then xy", "xy then z", "xy", "x y z", "g91", "arc")
    x, y, z = state.length(-20, 20), state.length(-20, 20), state.length(1, 9)
    if state.chance(0.3):
        x = y = "0"
    lines = {
        "xyz": [f"G0 X{x} Y{y} Z{z}"],
        "z then xy": [f"G0 Z{z}", f"X{x} Y{y}"],
        "xy then z": [f"G0 X{x} Y{y}", f"Z{z}"],
        "xy": [f"G0 X{x} Y{y}"],
        "x y z": [f"G0 X{x}", f"Y{y}", f"G1 Z{z} F{state.length(300, 900)}"],
        "g91": [f"G91 G0 X{x} Y{y}"],
        "arc": [f"G0 Z{z}", f"G2 I{state.length(2, 5)} J1 F{state.length(300, 900)}"],
    }[first]
    state.absolute = first != "g91"
    state.code = "G0"
    return lines


def _step(state: _State, *, rotary: bool, laser: bool) -> list[str]:
    kind = state.rng.random()
    if state.mild and kind >= 0.65:
        if kind < 0.9:
            return [state.pick("G92 X0 Y0", "G4 P0.2", "M0", "G17", "(a comment)", "T1 M6", "G94", "M1")]
        state.absolute = not state.absolute
        return ["G90" if state.absolute else "G91"]
    if kind < 0.55:
        return _moves(state, laser=laser, rotary=rotary)
    if kind < 0.65:
        return _arc(state)
    if kind < 0.70:
        return ["G90 G53 G0 " + state.pick("Z0", "X5 Y-5", "Z-3", "X0 Y0 Z0") + _after(state)]
    if kind < 0.75:
        return [
            state.pick("G28 Z0", "G28", "G30", "G91 G28 Z0\nG90", "G28 X1 Y1", "G91 G30 Z0\nG90")
            + _after(state, home=True)
        ]
    if kind < 0.80:
        return [state.pick(*SYSTEMS)]
    if kind < 0.83:
        return [
            state.pick(
                "G92 X0 Y0", "G92 X1 Y2 Z3", "G92.1", "G92 Z5", "G10 L2 P2 X3 Y4", "G10 L20 P1 X0 Y0 Z0"
            )
        ]
    if kind < 0.86:
        return [state.pick("G43 H1", "G49", "G43.1 Z2", "T2 M6", "T1", "M6")]
    if kind < 0.89:
        return [state.pick("G4 P0.2", "M0", "M1", "G4 P0")]
    if kind < 0.92:
        state.absolute = not state.absolute
        return ["G90" if state.absolute else "G91"]
    if kind < 0.94:
        state.plane = state.pick(*PLANES)
        return [state.plane]
    if kind < 0.96 and state.absolute:
        state.code = "G0"
        cycle = state.pick("G81", "G83", "G82")
        more = {"G81": "", "G83": " Q1", "G82": " P0.1"}[cycle]
        at = f"X{state.length(-20, 20)} Y{state.length(-20, 20)}"
        return [
            "G17",
            f"G98 {cycle} {at} Z-2 R1{more} F200",
            f"X{state.length(-20, 20)}",
            "G80",
            f"G0 Z{state.length(2, 9)}",
        ]
    return [state.pick("(a comment)", "M9", "M8", "S500", "G61", "G64 P0.05", "M3 S700", "M5")]


def _after(state: _State, *, home: bool = False) -> str:
    """G0 is said anew behind codes that stand beside it."""
    del home
    state.code = ""
    if not state.absolute:
        state.absolute = True
        return "\nG90"
    return ""


def _moves(state: _State, *, laser: bool, rotary: bool) -> list[str]:
    lines = []
    for _ in range(int(state.rng.integers(1, 6))):
        code = state.pick("G1", "G1", "G1", "G0")
        axes = [c for c in "XYZ" if state.chance({"X": 0.8, "Y": 0.7, "Z": 0.3}[c])] or ["X"]
        low, high = (-20, 20) if state.absolute else (-4, 4)
        words = [f"{c}{state.length(low, high) if c != 'Z' else state.length(-3, 5)}" for c in axes]
        if rotary and state.chance(0.2):
            words.append(f"A{int(state.rng.integers(-40, 40))}")
        if code == "G1" and (not state.fed or state.chance(0.3)):
            words.append(f"F{state.length(400, 4000)}")
            state.fed = True
        if laser and code == "G1" and state.chance(0.6):
            words.append(f"S{int(state.rng.integers(0, 1000))}")
        said = "" if code == state.code and state.chance(0.7) else code + " "
        state.code = code
        lines.append(said + " ".join(words))
    return lines


def _arc(state: _State) -> list[str]:
    """A full circle or a half one, which close whatever the place is."""
    a, _, i, j = PLANES[state.plane]
    radius, code = float(state.rng.uniform(1, 8)), state.pick("G2", "G3")
    state.code, feed = code, "" if state.fed else f" F{state.length(400, 2000)}"
    state.fed = True
    number = f"{radius / state.unit:.4f}"
    if state.chance(0.5) or state.absolute:
        return [f"{code} {i}{number} {j}0{feed}"]
    return [f"{code} {a}{2 * float(number):.4f} {i}{number} {j}0{feed}"]


def random_print(seed: int) -> str:
    """A printer's program: moves with E, retractions, travel, E as a place or a step."""
    rng = np.random.default_rng(seed)
    lines, extruded, steps, absolute = ["G21", "G90", "G28", "M104 S200", "M82", "G92 E0"], 0.0, False, True
    lines += ["G1 Z0.3 F600", "G0 X5 Y5"]

    def e(amount: float) -> str:
        nonlocal extruded
        extruded += amount
        return f"E{amount if steps or not absolute else extruded:.4f}"

    for _ in range(int(rng.integers(6, 16))):
        kind = rng.random()
        x, y = (f"{letter}{value:.3f}" for letter, value in zip("XY", rng.uniform(0, 40, 2), strict=True))
        if not absolute:
            x, y = (f"{letter}{value:.3f}" for letter, value in zip("XY", rng.uniform(-3, 3, 2), strict=True))
        fed = f" F{int(rng.integers(10, 60)) * 60}" if rng.random() < 0.5 else ""
        if kind < 0.4:
            lines += [f"G1 {x} {y} {e(1.2)}{fed or ' F1800'}", f"G1 {y} {e(0.3)}"]
        elif kind < 0.55:
            lines += [f"G1 {e(-0.8)} F2400", f"G0 {x} {y}", f"G1 {x}", f"G1 {e(0.8)}"]
        elif kind < 0.65:
            lines += [f"G0 {x} {y}{fed}", f"G0 {y}", f"G0 {x} {e(0.1)}"]
        elif kind < 0.75:
            steps = not steps
            lines.append("M83" if steps else "M82")
            if not steps:
                lines, extruded = [*lines, "G92 E0"], 0.0
        elif kind < 0.85:
            absolute = not absolute
            lines.append("G90" if absolute else "G91")
            if absolute:
                lines, extruded = [*lines, "M83" if steps else "M82", "G92 E0"], 0.0
        else:
            lines.append(("M106 S128", "G4 P200", "G92 E0", "; a layer")[int(rng.integers(4))])
            extruded = 0.0 if lines[-1] == "G92 E0" else extruded
    return "\n".join([*lines, "M84", ""])
