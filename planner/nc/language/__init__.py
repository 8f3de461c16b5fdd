"""Programs that compute: parameters, expressions, loops, branches and subprograms, expanded into rows of
words.

In reading order:

    tree        what a program says: expressions and statements, in no language's spelling
    compiled    statements to Python source, compiled once: `expressions` (and operators that all dialects have) in basic blocks
    rows        what the running program appends: row after row, given to the interpreter in chunks
    run         the running program: its parameters, calls and limits
    system_variables  parameters that hold the state of the control
    expression_reader  expressions by the ranks of their operators, for all dialects;  spelling: as RS274NGC and Fanuc write them
    linuxcnc, fanuc, heidenhain, siemens    a folder for each dialect: its text to statements
    source      the lines of a program: which are plain words, which belong to the language
    expand      a program through all of this;  flat: the expanded program as text

A language is a parser that makes a `tree.Program` and a `tree.Language` that says what its operators and
parameters mean; `compiled`, `rows` and `run` know no language.
"""
