"""The time-optimal feedrate problem along a fixed path, and its solvers."""
