"""The kinds of inputs, and what reads them.

None is guided: in the minutes that were measured (results/fuzz-guidance.md) more inputs reached more lines than guided ones. Tracing
takes two thirds of the time of NC programs; and the kept drawings and machines are those that are planned, which takes longer than a
refusal, and changed again and again their motions take hours. Trajectories and pages were not measured.
"""

from __future__ import annotations

from benchmarks.fuzz.pages import make_page, try_page
from benchmarks.fuzz.programs import make_program, try_program
from benchmarks.fuzz.run import Kind
from benchmarks.fuzz.settings import (
    make_drawing,
    make_machine,
    make_settings,
    try_drawing,
    try_machine,
    try_settings,
)
from benchmarks.fuzz.trajectories import make_trajectory, try_trajectory

_JUDGED = ("planner/report/trajectory_reader.py", "planner/report/trajectory_room.py", "planner/verifier")
KINDS = {
    "nc": Kind(make_program, try_program, ("planner/nc",), guided=False),
    "hpgl": Kind(
        make_drawing, try_drawing, ("planner/nc/hpgl", "planner/nc/language/detect.py"), guided=False
    ),
    "machine": Kind(make_machine, try_machine, ("planner/machine", "planner/verifier"), guided=False),
    "imports": Kind(
        make_settings, try_settings, ("planner/controls/machine_import", "planner/machine"), guided=False
    ),
    "trajectory": Kind(
        make_trajectory, try_trajectory, (*_JUDGED, "planner/planning/job"), guided=False, joined=False
    ),
    "report": Kind(
        make_page, try_page, ("planner/report", "planner/planning/job"), guided=False, joined=False
    ),
}
