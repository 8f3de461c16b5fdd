"""Reading and writing NC programs."""
