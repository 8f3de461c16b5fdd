"""Siemens' language (Sinumerik): `text` its expressions and words, `codes` its tables, `control` loops and jumps, `commands` and
`drilling` what is no word, `parser` all of it as statements."""
