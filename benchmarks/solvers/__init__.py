"""Solvers compared, and what they cost."""
