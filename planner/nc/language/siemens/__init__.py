"""Siemens' language (Sinumerik): `text` its expressions and words, `drilling` its cycles, `parser` all of it as statements."""
