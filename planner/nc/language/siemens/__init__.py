"""Siemens' language (Sinumerik): `text` its expressions, words, loops and jumps, `commands` its tables and
what is no word, `cycles`, `block_words` rows of words, `parser` all of it as statements."""
