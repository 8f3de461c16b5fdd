"""Macros of Fanuc and Haas: `calls` loops, calls and returns, `parser` all of it as statements, `lathe`,
`lathe_words` and `lathe_cycles` lathes."""
