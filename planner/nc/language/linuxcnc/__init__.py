"""LinuxCNC's language (O words) as statements."""
