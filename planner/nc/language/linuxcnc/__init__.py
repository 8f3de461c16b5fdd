"""LinuxCNC's language (O words): `text` its expressions, `control` its loops and branches, `parser` all of it
as statements."""
