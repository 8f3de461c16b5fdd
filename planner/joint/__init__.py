"""The free optimum inside the tolerance: geometry and feed of a short job found together."""
