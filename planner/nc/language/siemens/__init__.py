"""Siemens' language (Sinumerik): `text` expressions, `control` loops, jumps and variables, `commands` and
`block_words` commands and words, `cycles`, `parser` all of it as statements."""
