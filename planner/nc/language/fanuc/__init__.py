"""Macros of Fanuc and Haas: `text` their expressions, `calls` calls and returns, `parser` all of it as statements."""
