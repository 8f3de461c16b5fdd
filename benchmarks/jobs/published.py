"""Cases of the literature whose path and limits are printed, and the times that were published for them.

A path stands here as printed: control points, weights and knots, a formula, or points. `differs` says what is not like for like. What
cannot be made from what is printed is in `LEFT_OUT`, with the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.jobs import problems
from benchmarks.solvers.random_paths import CURVES
from planner.geometry.nurbs import Nurbs
from planner.machine import Axis, Machine
from planner.machine.kinematics import at_tip
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.report.interactive.points import tip_path

FREE = 1e9  # a limit that is not printed, so that it never acts [mm/s2, mm/s3]
ON_THE_PATH = 1e-3  # tolerance of cases whose path is exact: small beside the chords of a period [mm]
SINUSOID_POINTS = 2001  # through which a cubic spline is within 1e-8 mm of the formula
POCKET_POINTS = 501  # of the five-axis path
HALF_TURN = 5.0  # radius of the half-arcs of the tube problem [mm]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case.

    source    : where path, limits and times are printed
    published : who reached which time, as printed; "" where none is
    way       : the way of the planner that is like for like
    differs   : what is not like for like
    length    : of the path [mm], to the last digit
    """

    name: str
    source: str
    published: str
    way: str
    differs: str
    length: float
    program: Callable[[], Program]
    machine: Callable[[], Machine]


def trident() -> Nurbs:
    """Beudaert, Lavernhe and Tournier 2012, appendix A: y of the outer points is 27, not 20 as elsewhere."""
    points = [(10, 0), (20, 27), (12, 8), (10, 20), (8, 8), (0, 27), (10, 0)]
    return _nurbs(points, [0, 0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1, 1])


def butterfly() -> Nurbs:
    """Nie et al. 2023, table 7 (its labels of weights and knots are exchanged): the classical one of 51 points."""
    given = CURVES["butterfly"]
    return _nurbs(given["points"], given["knots"], given["weights"])


def figure_8() -> Nurbs:
    """Nie et al. 2023."""
    points = [(0, 0), (-150, -150), (-150, 150), (0, 0), (150, -150), (150, 150), (0, 0)]
    return _nurbs(points, [0, 0, 0, 0, 0.354, 0.5, 0.646, 1, 1, 1, 1], [1, 25, 25, 1, 25, 25, 1])


def sinusoid() -> Nurbs:
    """He et al. 2022: z = 50 (1 - cos(20 pi x / 1000)) mm for x from -100 to 100 mm, as a cubic spline through points of it."""
    from scipy.interpolate import make_interp_spline

    x = np.linspace(-100.0, 100.0, SINUSOID_POINTS)
    z = 50.0 * (1.0 - np.cos(0.02 * np.pi * x))
    spline = make_interp_spline(x, np.stack([x, z], axis=1), k=3)
    return _nurbs(spline.c, spline.t)


def pocket() -> tuple[Nurbs, Nurbs]:
    """Ma et al. 2022, appendix 1, after Beudaert et al. 2012: the curve of the tip, and that of a second point of the tool."""
    knots = [0, 0, 0, 0, 0.2, 0.4, 0.6, 0.8, 1, 1, 1, 1]
    bottom = zip((5, -10, 10, 20, 30, 40, 50, 55), (0, 20, 20, 30, 30, 30, 20, 0), [0] * 8, strict=True)
    top = zip((0, -15, 5, 15, 30, 45, 55, 60), (0, 20, 25, 35, 35, 35, 25, 0), [15] * 8, strict=True)
    return _nurbs(list(bottom), knots), _nurbs(list(top), knots)


def pocket_program() -> Program:
    """The pocket as tips and directions of the tool; no feed is printed."""
    bottom, top = (curve.at(np.linspace(0.0, 1.0, POCKET_POINTS)) for curve in pocket())
    return tip_path(ma(), bottom, directions=top - bottom, feed=1000.0)


def tube() -> Program:
    """The test problem CNOC of pins-ocs/OCP-tests, data/CNOC_Data.rb: seven rows of two lines each, that rise by 2 mm to their middle,
    joined by half-arcs on the right and lines on the left."""
    blocks, y = ["G21 G17 G90 G94 G64 F10380", "G92 X-10 Y0"], 0
    for row in range(7):
        right = row % 2 == 0
        blocks += [f"G1 X20 Y{y + 2}", f"G1 X{50 if right else -10} Y{y}"]
        y += 10
        if row < 6:
            blocks.append(f"G3 X50 Y{y} I0 J{HALF_TURN:g}" if right else f"G1 Y{y}")
    return parse_program("\n".join([*blocks, "M2", ""]), source="CNOC")


LABEL = (  # a frame with round corners, a circle and a star, in HPGL
    "IN;SP1;VS30;PU200,0;PD3000,0;AA3000,200,90;PD3200,2200;AA3000,2200,90;PD200,2400;AA200,2200,90;PD0,200;AA200,200,90;"
    "PU2600,1200;CI300;PU1600,1800;PD1747,1402,2171,1385,1838,1123,1953,715,1600,950,1247,715,1362,1123,1029,1385,1453,1402,1600,1800;"
    "PU0,0;SP0;"
)


def mikron(overrun: float = 1.0) -> Machine:
    """X and Y of the Mikron UCP710 of Beudaert et al.; their interpolator may exceed the jerks, that along the path too, by 20 %.
    Cubics join the setpoints: chords of 6 ms would leave the path by up to 13 um, and no limit on that is printed."""
    axes = {
        name: Axis(velocity=500.0, acceleration=acceleration, jerk=overrun * 5000.0)
        for name, acceleration in (("x", 2500.0), ("y", 3000.0))
    }
    return Machine(
        name="UCP710",
        dt=0.006,
        interpolation="cubic",
        tolerance=ON_THE_PATH,
        axes=axes,
        tangential_jerk=overrun * 5000.0,
    )


def nie(inside: bool) -> Machine:
    """Nie et al. 2023: accelerations of 1000 mm/s2 and jerks of 1e5 mm/s3, along the path and normal to it. The planner limits the
    jerk of the axes: 1/sqrt(2) of it lies `inside`, sqrt(2) outside of what the two allow together."""
    jerk = 1e5 * (2.0**-0.5 if inside else 2.0**0.5)
    axis = Axis(velocity=200.0, acceleration=1000.0 * 2.0**0.5, jerk=jerk)
    return Machine(
        name="Nie",
        dt=0.002,
        tolerance=ON_THE_PATH,
        axes={"x": axis, "y": axis},
        normal_acceleration=1000.0,
        tangential_acceleration=1000.0,
        tangential_jerk=1e5,
    )


def ma() -> Machine:
    """Ma et al. 2022, table 4, a tilting table whose axes meet in the origin of the workpiece (their eq. 2). A chord error of at most
    0.125 um at 2 ms is a normal acceleration of the tip of at most 250 mm/s2 (their eq. 6)."""
    linear = Axis(velocity=100.0, acceleration=500.0, jerk=3000.0)
    a, c = (
        Axis(velocity=np.rad2deg(v), acceleration=np.rad2deg(0.5), jerk=np.rad2deg(1.5)) for v in (0.4, 0.8)
    )
    return Machine(
        name="Ma",
        dt=0.002,
        tolerance=2.0 * ON_THE_PATH,
        axes={"x": linear, "y": linear, "z": linear, "a": a, "c": c},
        kinematics={"type": "xyzac-trt"},
        normal_acceleration=8.0 * 0.125e-3 / 0.002**2,
    )


def he() -> Machine:
    """He et al. 2022."""
    axis = Axis(velocity=400.0, acceleration=4000.0, jerk=FREE)
    return Machine(name="He", dt=0.001, tolerance=ON_THE_PATH, axes={"x": axis, "y": axis})


def cnoc() -> Machine:
    """CNOC: accelerations of 2100 (x, y, along the path) and 1200 mm/s2 (normal), jerks of -5e4 to 3e4 along the path and 6.5e4 mm/s3
    normal to it."""
    axis = Axis(velocity=FREE, acceleration=2100.0, jerk=6.5e4)
    return Machine(
        name="CNOC",
        dt=0.001,
        tolerance=0.01,
        axes={"x": axis, "y": axis},
        normal_acceleration=1200.0,
        tangential_acceleration=2100.0,
        tangential_jerk=3e4,
    )


def paper_002() -> Machine:
    """Paper 002: 6000 mm/min, 3.6e7 mm/min2 of the axes and normal, 4 ms, 0.05 mm; it prints no jerk."""
    return problems.machine(acceleration=1e4, jerk=FREE, dt=0.004, normal_acceleration=1e4)


def paper_003() -> Machine:
    """Paper 003: 2000 mm/s2, 300 mm/s, 10 ms, 0.05 mm; the jerk is paper 000's, as it prints none."""
    return problems.machine(velocity=300.0, jerk=2000.0 / 0.03, dt=0.01)


def pentagon() -> Program:
    """Paper 000: 78.91 mm, six moves that turn by 72 degrees, at the feed that its times need (docs/papers.md, E, reading ii)."""
    angle = np.deg2rad(72.0) * np.arange(6)
    steps = 78.91 / 6 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return problems.polyline(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), feed=84.3, source="pentagon")


def _nurbs(points, knots, weights=None) -> Nurbs:
    return Nurbs(
        degree=3,
        points=np.array(points, float),
        knots=np.array(knots, float),
        weights=np.ones(len(points)) if weights is None else np.array(weights, float),
    )


def _exact(curve: Callable[[], Nurbs], feed: float) -> Callable[[], Program]:
    return lambda: curve().exact_program(feed)


BEUDAERT = "Beudaert, Lavernhe, Tournier, Int. J. Mach. Tools Manuf. 57 (2012) 73, appendix A"
NIE = "Nie et al., IEEE Access 2023, 10.1109/ACCESS.2023.3248081"
VPOP = "VPOp 2.3; measured on a Siemens 840D 2.4"
JCFS = "JCFS 8.712, DICT 11.29; CSFA 5.547 and DBLA 5.397 break the chord limit"
SERVO = (
    "their contour error of at most 50 um is that of a servo whose gains are not at hand. On an arc a servo of velocity gain K lags by "
    "v^2 kappa / (2 K^2): a normal acceleration below 2 K^2 50 um, which binds for K below 100/s"
)
JERKS = "jerk along the path and normal to it, here along the path and of the axes"

CASES = (
    Case(
        name="trident", source=BEUDAERT, published=VPOP, way="optimal", length=59.168,
        differs="VPOp may exceed jerks by 20 %; the 840D's own settings are not printed; 1 um of tolerance",
        program=_exact(trident, 50.0), machine=mikron,
    ),
    Case(
        name="trident, jerks 120 %", source=BEUDAERT, published=VPOP, way="optimal", length=59.168,
        differs="all jerks at 120 %, like VPOp; 1 um of tolerance", program=_exact(trident, 50.0), machine=partial(mikron, 1.2),
    ),
    Case(
        name="butterfly, inside", source=NIE, published=JCFS, way="optimal", length=382.857,
        differs=f"{JERKS}, inside both; {SERVO}",
        program=_exact(butterfly, 200.0), machine=partial(nie, True),
    ),
    Case(
        name="butterfly, outside", source=NIE, published=JCFS, way="optimal", length=382.857,
        differs="the same, outside both", program=_exact(butterfly, 200.0), machine=partial(nie, False),
    ),
    Case(
        name="figure 8", source=NIE, published="", way="optimal", length=1227.551,
        differs="no time of the whole curve is printed", program=_exact(figure_8, 200.0), machine=partial(nie, True),
    ),
    Case(
        name="sinusoid", source="He et al., ISA Trans. 131 (2022) 639", way="second-order", length=460.979,
        published="strict optimum 1.4436, online 1.4452, S-curve look-ahead 1.6042",
        differs="1 um of tolerance; no jerk limit", program=_exact(sinusoid, 1000.0), machine=he,
    ),
    Case(
        name="five-axis pocket", source="Ma et al., J. Comput. Des. Eng. 9 (2022) 2355, 10.1093/jcde/qwac116", way="optimal",
        published="ICVP 9.44; LP 22.976; Beckhoff, without jerk limits, 24.564", length=98.168,
        differs="2 um of tolerance, of the direction too at 50 mm; their control is constant in some 200 steps",
        program=pocket_program, machine=lambda: at_tip(ma()),
    ),
    Case(
        name="CNOC", source="pins-ocs/OCP-tests, test CNOC", published="", way="optimal", length=498.056,
        differs="its objective is to hold the feed of 173 mm/s, not the time; the smaller one of its two jerks along the path; jerk of "
        "the axes for the normal one",
        program=tube, machine=cnoc,
    ),
    Case(
        name="000 pentagon", source="paper 000", published="point to point 1.416, overlapped 1.209", way="fir", length=78.91,
        differs="78.91 mm and 84.3 mm/s instead of 78.91 cm and 100 mm/s, which contradict its times; `fir-plain` has its rules, "
        "which break the jerk limit",
        program=pentagon, machine=partial(problems.machine, jerk=2000.0 / 0.03, tolerance=0.1),
    ),
    Case(
        name="002 five points", source="paper 002", published="", way="second-order", length=2.510,
        differs="no jerk is printed, so none is limited; errors only are drawn", program=problems.five_points, machine=paper_002,
    ),
    Case(
        name="003 label", source="paper 003", published="error within 0.025 mm; 13 % less time", way="kinematic", length=601.000,
        differs="another drawing: its own is a picture; jerk from paper 000; the error here is that at the vertices, that of the "
        "contour is within 0.025 mm (tests/planning/methods/test_kinematic.py)",
        program=lambda: parse_program(LABEL, source="label.plt"), machine=paper_003,
    ),
)  # fmt: skip

LEFT_OUT = {
    "Beudaert et al. 2012, open pocket (planned 2.8 s, measured 3.7 s)": "the path is printed, but not where the machine's rotary axes "
    "are, and the limits are those of its axes",
    "Beudaert et al. 2012, lock (4.2 s, 4.5 s)": "the path is a figure",
    "Ma et al. 2022, impeller (3.16 s) and S piece (11.55 s)": "the paths are figures",
    "He et al. 2022, squircle (1.7000 s)": "does not reproduce: the optimum of the printed data is 1.646 s wherever it starts",
    "Consolini et al. 2022, kappa = 0.2 sin(s/10) (20.65 s)": "does not reproduce: the optimum of the printed data is 15.214 s",
    "J-NNC, square and circle (100 mm/s, 2000 mm/s2, 62,500 mm/s3)": "their sizes and times were not at hand",
    "paper 001": "no curve, limit or time is printed",
}
