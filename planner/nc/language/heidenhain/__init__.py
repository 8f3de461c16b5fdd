"""Heidenhain's conversational language: `text` its lines and formulas, `items` and `moves` its path functions, `flow` labels and
jumps, `definitions` and `drilling` tools and cycles, `parser` all of it as statements."""
