"""Reading and writing NC programs.

In reading order: `program` (the record), `codes` and `block` (what a line may hold), `state` and `arcs` (what
it means), `lexer`, `plain` and `interpreter` (how it is read), `reader` and `info` (what others call).
"""
