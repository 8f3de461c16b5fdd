"""The feedrate problem with jerk limits: an interior-point method on the exact kinematics, in windows."""
