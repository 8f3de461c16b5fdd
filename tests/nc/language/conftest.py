"""Makes what the tests of the dialects share importable: `language_programs`."""
