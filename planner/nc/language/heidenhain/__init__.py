"""Heidenhain's conversational language: `text` its lines, words and formulas, `moves` its path functions,
`flow` labels and jumps, `definitions` and `cycles` tools and cycles, `parser` all of it as statements."""
