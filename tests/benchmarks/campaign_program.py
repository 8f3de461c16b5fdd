"""What the tests of the campaign share: a machine, and a program with all kinds of blocks."""

from planner.machine import Axis, Machine

AXIS = Axis(velocity=120.0, acceleration=2000.0, jerk=60000.0)
MACHINE = Machine(
    name="test", dt=0.001, tolerance=0.05, axes=dict.fromkeys("xyz", AXIS), normal_acceleration=1500.0
)
TEXT = """G21 G17 G90 G94 G64 F3000
G1 X10
G1 X10 Y8
G2 X14 Y12 I4 J0
G4 P0.02
G1 X20 Y12
G61
G3 X26 Y18 R6
G64
G5 X34 Y26 I3 J0 P-3 Q0
G0 X30 Y30
G1 X0 Y30 F1200
M2
"""
