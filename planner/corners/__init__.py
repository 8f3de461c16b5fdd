"""Rounding corners within the tolerance: shapes, error budgets, and how neighbours share a short leg."""
