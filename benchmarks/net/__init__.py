"""What the planner does, recorded and compared; what it loses without a part."""
