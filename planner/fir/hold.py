"""Leading the filters along a guide, and slowing down until the motion that leaves them keeps tolerance and limits.

The command runs the guide's chords one after another at a constant speed each; two moving averages make the motion of it, exactly
(fir/superpose.py). The length along the guide, filtered like the axes, tells which point of it the motion belongs to; it never goes
back, so that the largest distance to that point bounds the deviation both ways and in order.

What is exceeded is mended where it comes from:

* error          the chords that turn, around the one that is commanded Td/2 before, get slower; a corner's then last as long as the
                 gap that paper 000 leaves between two pulses;
* acceleration   T1 gets longer, up to twice V/A: whatever the command, |a| <= 2 V/T1 (PAPERS, universal identity);
* jerk           T2 gets longer, up to twice A/J: |j| <= 4 V/(T1 T2).

Should that not come to an end, or should the filters be given, everything gets slower, which always does.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planner.arrays import Array, FloatArray
from planner.fir.audit import slowest
from planner.fir.command import Command
from planner.fir.guide import STRAIGHT, Guide
from planner.fir.spline_speeds import filter_lengths, v_acc_eps, v_mean
from planner.fir.superpose import Pieces, superpose
from planner.machine import Machine
