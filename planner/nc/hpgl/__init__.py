"""Reading plotter files (HPGL) into the same record as NC programs."""
