"""The time-optimal methods: choose a geometry, solve, tighten, deliver."""
