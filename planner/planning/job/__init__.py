"""A job from program to plan, and the records that it is told in."""
