"""The ground of everything else: arrays in records, errors, units, files, searches, compiled kernels."""
