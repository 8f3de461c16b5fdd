"""What plans cost: computing time, memory, installation.

What was tried to make them cheaper and brought nothing, so that it is not tried again in the same way:

    the search     multipliers of the search in long steps handed on to the second one, other first slacks, starts nearer to
                   the optimum: fewer iterations on reliefs, none fewer or more on random jobs, since other rows hold
                   the motion there; durations frozen as soon as the kinematics nearly hold: more iterations; products of
                   slacks and multipliers held at 0.3 of what is aimed at, not 0.1: as many (at 0.01 some windows do not end)
    windows        of 500 steps for short runs too, or overlapping by half as much: slower motions; all in lanes however few
                   lanes are filled: arcs take longer; all numbers of one step behind each other, in place of one array for each
                   quantity: as long.
    threads        a shorter switch interval of Python's lock: as long
    memory         freed arrays given back at once (MALLOC_TRIM_THRESHOLD_, MALLOC_MMAP_THRESHOLD_): a tenth less of 0.8 GB for a
                   quarter to two fifths more CPU seconds
    first motion   on a coarser grid: cheaper on long programs of short blocks, dearer on random ones, some motions slower
    the verdict    fewer looks between setpoints where the acceleration is small: distances from vertices are those of
                   chords between looks, right motions were refused; the worst of each quantity found by a kernel of its
                   own: numpy's division and argmax are as fast (but not as one pass for all of them: planner/verifier/limits.py);
                   motions of long runs evaluated together: what they take is arithmetic, not calls (of short runs it is
                   calls: planner/joint/parts.py)
    splines        kernels that may multiply and add in one instruction: as long as before
    kernels        in numba's own cache, in three ways: results/first-run.md; Python's collector switched off while they are
                   compiled: 5 % (four fifths of that time are numba's own passes in Python, not the compiler's)
"""
