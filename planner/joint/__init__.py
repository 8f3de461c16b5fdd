"""The joint search: path and feed found together, in time, inside the tolerance."""
