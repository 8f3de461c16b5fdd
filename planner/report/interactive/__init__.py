"""Python and notebooks beside the command line: programs of points, any motion judged, plans as pictures and
tables."""
