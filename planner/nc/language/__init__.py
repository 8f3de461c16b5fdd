"""Programs that compute: parameters, expressions, loops, branches and subprograms, expanded into rows of
words.

    tree, tokens, spelling               what a program says, in no language's spelling; expressions, and how RS274NGC writes them
    linuxcnc, fanuc, heidenhain, siemens a folder for each dialect: its text to statements and a `tree.Language`
    source, detect                       which lines are plain words, which belong to a language
    expressions, compiled, run, rows     statements to Python source, the running program, the rows that it appends
    making, makers, milling              rows that Python makes while it runs
    rows_through, travel, corner_moves   frames, compensation and corners on the rows' way to the interpreter
    expand                               a program through all of this; ../writer.py has it as text
"""
