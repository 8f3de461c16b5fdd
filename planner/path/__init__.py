"""The smooth path sampled: points, derivatives, and the grid that the feedrate problem is posed on.

`planner.path(points)` makes a program of points (interactive/points.py).
"""

from planner.base.called import call_like

call_like(__name__, "planner.interactive.points:path")
