"""Which programs are read."""
