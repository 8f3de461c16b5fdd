"""Kinematics of five-axis machines: from the tool's tip and direction to the joints and back.

chain.py        the closed forms of four kinds of machines; joints and their first three derivatives along a path
directions.py   rotary angles from tool directions, and the pole
expression.py   kinematics of one's own, as a casadi expression
limits.py       the joints' limits on a path of the tool's tip
"""

from planner.machine.kinematics.chain import Chain, Kinematics, kinematics_of
from planner.machine.kinematics.expression import expression
from planner.machine.kinematics.limits import at_tip

__all__ = ["Chain", "Kinematics", "at_tip", "expression", "kinematics_of"]
