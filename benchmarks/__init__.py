"""Measuring the planner: problems, runners, results."""
