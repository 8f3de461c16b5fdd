"""The smooth path sampled: points, derivatives, and the grid that the feedrate problem is posed on."""
