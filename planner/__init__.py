"""Optimisation-based feedrate planning for CNC machines."""
