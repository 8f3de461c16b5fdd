"""One smooth path inside the tolerance: quintic splines that replace runs of blocks between full stops."""
