"""A plan in files that a control plays: setpoints for LinuxCNC's HAL, and positions, velocities and times
(PVT); programs for controls; a program with fewer lines."""
