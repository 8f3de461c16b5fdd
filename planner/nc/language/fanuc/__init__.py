"""Macros of Fanuc and Haas: `text` their expressions, `control` loops, `calls` calls and returns, `parser`
all of it as statements."""
