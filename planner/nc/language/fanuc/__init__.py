"""Macros of Fanuc and Haas: `calls` calls and returns, `parser` all of it as statements, `lathe`,
`lathe_words` and `lathe_cycles` lathes."""
