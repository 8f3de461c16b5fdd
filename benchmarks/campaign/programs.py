"""Random programs of the campaign: of everything that moves, and of points on a curve."""

from __future__ import annotations

import numpy as np

from planner.machine import Machine

BLOCKS = 40  # of a program, at most
Rng = np.random.Generator


def mixed(rng: Rng, machine: Machine) -> str:
    """Lines, arcs, helices, splines, rapids and dwells under changing path control, feeds and tolerances."""
    scale = 10 ** rng.uniform(-1.5, 1.7)  # of the blocks [mm]
    lines = [
        f"G21 G17 G90 G94 M83 F{_feed(rng)}" if "e" in machine.axes else f"G21 G17 G90 G94 F{_feed(rng)}"
    ]
    if rng.random() < 0.5:
        lines.append(_control(rng))
    at, heading = np.zeros(3), rng.uniform(0, 2 * np.pi)
    rotary = [letter for letter in "ABC" if letter.lower() in machine.axes]
    for _ in range(int(min(2 + rng.exponential(7.0), 30))):
        size = scale * 10 ** rng.uniform(-1.0, 0.5) * (1e-2 if rng.random() < 0.05 else 1.0)
        heading += float(
            rng.choice(
                [0.0, np.pi / 2, np.pi, rng.normal(), 0.01 * rng.normal()], p=[0.2, 0.15, 0.05, 0.4, 0.2]
            )
        )
        new = at + size * np.array([np.cos(heading), np.sin(heading), rng.normal() * (rng.random() < 0.2)])
        new = np.round(new, int(rng.choice([2, 3, 4, 6], p=[0.1, 0.5, 0.3, 0.1])))
        choice, more = rng.random(), ""
        if "e" in machine.axes and rng.random() < 0.5:
            more += f" E{rng.normal() * 0.05 * size:.5f}"
        if rotary and rng.random() < 0.5:
            more += "".join(f" {letter}{rng.normal() * 20:.3f}" for letter in rotary if rng.random() < 0.6)
        if rng.random() < 0.15:
            more += f" F{_feed(rng)}"
        place = f"X{new[0]:.6f} Y{new[1]:.6f} Z{new[2]:.6f}"
        if choice < 0.5:
            lines.append(f"G1 {place}{more}")
        elif choice < 0.72:
            radius = float(np.hypot(*(new - at)[:2])) * rng.uniform(0.51, 4.0)
            sign = "-" if rng.random() < 0.15 else ""
            if radius < 1e-3:
                continue
            lines.append(f"G{rng.integers(2, 4)} {place} R{sign}{radius:.6f}{more}")
        elif choice < 0.78:
            i, j, p, q = size * rng.normal(size=4) * 0.5
            new[2] = at[2]
            lines.append(f"G5 X{new[0]:.6f} Y{new[1]:.6f} I{i:.6f} J{j:.6f} P{p:.6f} Q{q:.6f}")
        elif choice < 0.83:
            turn = "".join(f"{'IJ'[k]}{size * rng.normal():.5f} " for k in range(2))
            new = at + np.array([0.0, 0.0, size * rng.normal() * (rng.random() < 0.5)])
            lines.append(
                f"G{rng.integers(2, 4)} X{new[0]:.6f} Y{new[1]:.6f} Z{new[2]:.6f} {turn}P{rng.integers(1, 3)}"
            )
        elif choice < 0.9:
            lines.append(f"G0 {place}")
        elif choice < 0.94:
            lines.append(f"G4 P{10 ** rng.uniform(-4, -1):.5f}")
            continue
        else:
            lines.append(_control(rng))
            continue
        at = new
    return "\n".join([*lines, "M2"]) + "\n"


def dense(rng: Rng) -> str:
    """Points on a wave, as CAM writes curves, with noise and rounding of the coordinates."""
    count, size = int(min(4 + rng.exponential(9.0), BLOCKS - 1)), 10 ** rng.uniform(-1.0, 1.7)
    u = np.linspace(0.0, rng.uniform(1.0, 7.0), count + 1)
    bent, phase = rng.uniform(0.2, 1.0), rng.uniform(0, 6.28)
    points = size * np.stack([np.cos(u + phase), np.sin((1 + bent) * u), 0.2 * bent * np.sin(3 * u)], axis=1)
    points = points - points[0] + rng.normal(size=points.shape) * size * 10 ** rng.uniform(-7, -2.5)
    digits = int(rng.choice([2, 3, 4, 6]))
    lines = [f"G21 G17 G90 G94 F{_feed(rng)}"] + ([_control(rng)] if rng.random() < 0.3 else [])
    lines += [f"G1 X{x:.{digits}f} Y{y:.{digits}f} Z{z:.{digits}f}" for x, y, z in points[1:]]
    return "\n".join([*lines, "M2"]) + "\n"


def _feed(rng: Rng) -> str:
    return f"{60 * 10 ** rng.uniform(0.0, 2.7):.1f}"


def _control(rng: Rng) -> str:
    return str(rng.choice(["G61", "G61.1", "G64", f"G64 P{10 ** rng.uniform(-3, 0):.4f}"]))
