"""The feedrate problem with jerk limits written out for other solvers: to read, and to check against."""
