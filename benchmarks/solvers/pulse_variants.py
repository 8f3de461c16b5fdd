"""How far do pulse counts drift? Ways of sharing pulses between two axes, paper 003's and others (docs/papers.md F10).

600 interpolation periods of 10 ms (the paper's), X the long axis. Every period an axis should send f T pulses; the variants are

    no carry      n = floor(f T) on both axes, what is left over is forgotten
    eq. 11-12     n'_x = floor(T f_x), T'_x = n'_x/f_x;  dT = T'_x - n'_y/f_y as printed, T_y = T'_x + dT of the period before,
                  n'_y = floor(f_y T_y): the remainder does not contain the one before. (With V_y n'_y in the place of T'_x, as (12)
                  is printed, no pulse would be added at all.)
    seconds       the same with dT = T_y - n'_y/f_y, the accumulated remainder, still as a time
    pulses        n_k = floor(c_k) - floor(c_{k-1}) with c = the sum of f T, on both axes

The deviation of Y is against Y's own path over the time that X took (X never catches up what it floors away).

python -m benchmarks.solvers.pulse_variants        writes benchmarks/results/pulse-variants.json and .md
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.record import markdown, write_results
from planner.base.arrays import Array, FloatArray

PERIOD = 0.01  # [s], the paper's
PERIODS = 600
SEED = 3
# Pulses of Y per pulse of X.
SLOPES = (0.21, 0.5, 0.618034, 0.83)


def speeds() -> dict[str, FloatArray]:
    """Pulses per second of X, period by period."""
    tau = (np.arange(PERIODS) + 0.5) / PERIODS
    ramp = np.clip(np.minimum(tau, 1.0 - tau) / 0.2, 0.0, 1.0)
    s_profile = 5037.0 * ramp**2 * (3.0 - 2.0 * ramp)
    rng = np.random.default_rng(SEED)
    return {"S-profile": np.maximum(s_profile, 1.0), "random speeds": rng.uniform(50.0, 10_000.0, PERIODS)}


def no_carry(fx: FloatArray, fy: FloatArray) -> tuple[Array, Array, FloatArray]:
    """Pulses of X and Y per period, and how long each period lasts [s]."""
    return np.floor(fx * PERIOD), np.floor(fy * PERIOD), np.full(len(fx), PERIOD)


def in_seconds(fx: FloatArray, fy: FloatArray, *, accumulated: bool) -> tuple[Array, Array, FloatArray]:
    """Equations (10) to (12): X floored, Y's remainder carried as a time."""
    nx = np.floor(fx * PERIOD)
    lasting = nx / fx
    ny = np.zeros(len(fy))
    carry = 0.0
    for k in range(len(fy)):
        available = lasting[k] + carry
        ny[k] = np.floor(fy[k] * available)
        carry = (available if accumulated else lasting[k]) - ny[k] / fy[k]
    return nx, ny, lasting


def in_pulses(fx: FloatArray, fy: FloatArray) -> tuple[Array, Array, FloatArray]:
    """The remainder carried in pulses, on both axes."""
    nx, ny = (np.diff(np.floor(np.cumsum(f * PERIOD)), prepend=0.0) for f in (fx, fy))
    return nx, ny, np.full(len(fx), PERIOD)


VARIANTS = {
    "no carry": no_carry,
    "eq. 11-12": lambda fx, fy: in_seconds(fx, fy, accumulated=False),
    "seconds": lambda fx, fy: in_seconds(fx, fy, accumulated=True),
    "pulses": in_pulses,
}


def deviations(variant: str, fx: FloatArray, slope: float) -> dict[str, float]:
    """Final and largest deviation of Y [pulses] from its path, and what X lacks at the end."""
    fy = slope * fx
    nx, ny, lasting = VARIANTS[variant](fx, fy)
    off = np.cumsum(ny) - np.cumsum(fy * lasting)
    return {
        "y_final": float(off[-1]),
        "y_largest": float(np.abs(off).max()),
        "x_missing": float((fx * PERIOD).sum() - nx.sum()),
    }


def main() -> None:
    rows: list[dict[str, Any]] = [
        {"speeds": name, "slope": slope, "variant": variant, **deviations(variant, fx, slope)}
        for name, fx in speeds().items()
        for slope in SLOPES
        for variant in VARIANTS
    ]
    table = markdown(
        ["speeds", "Y per X", "variant", "Y final", "Y largest", "X missing"],
        [
            [row["speeds"], f"{row['slope']:g}", row["variant"]]
            + [f"{row[key]:.1f}" for key in ("y_final", "y_largest", "x_missing")]
            for row in rows
        ],
    )
    title = f"# Deviation in pulses over {PERIODS} periods of {1e3 * PERIOD:g} ms\n\n"
    write_results(
        "pulse-variants", {"seed": SEED, "period_s": PERIOD, "periods": PERIODS, "rows": rows}, title + table
    )
    print(table)


if __name__ == "__main__":
    main()
