"""Heidenhain's conversational language: `text` lines, words and formulas, `moves` path functions and frames,
`flow` labels and jumps, `definitions` and `cycles` tools and cycles, `parser` all of it as statements."""
