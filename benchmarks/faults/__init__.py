"""What goes wrong around the planner, and what must not change."""
