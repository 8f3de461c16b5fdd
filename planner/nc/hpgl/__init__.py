"""Reading plotter files (HPGL), as pen plotters and cutting plotters take them, into the same record as NC
programs.

In reading order: `instructions` (what there is, why some of it is not read, how it is written), `plotter`
(what it means), `drawing` (user units, the blocks so far).
"""
