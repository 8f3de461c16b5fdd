"""Heidenhain's conversational language: `text` its lines and formulas, `moves` its path functions, `drilling` its cycles, `parser` all
of it as statements."""
