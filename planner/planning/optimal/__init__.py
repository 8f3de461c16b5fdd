"""The time-optimal methods: choose a geometry, solve, reshape, solve, tighten, deliver."""
