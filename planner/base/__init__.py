"""What everything else stands on: arrays in records, errors, units, files, searches, compiled kernels."""
