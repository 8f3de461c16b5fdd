"""Macros of Fanuc and Haas: `calls` loops, calls and returns, `parser` all of it as statements, `lathe*` lathes."""
