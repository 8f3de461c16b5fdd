"""Inputs changed by chance."""
