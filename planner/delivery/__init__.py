"""From a motion to setpoints that hold behind samples and filters."""
