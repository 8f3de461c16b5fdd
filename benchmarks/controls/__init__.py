"""What controls make of programs, and what leaves the planner for them."""
