"""Siemens' language (Sinumerik): `text` expressions, loops and jumps, `commands` and `block_words` commands
and words, `cycles`, `parser` all of it as statements."""
