"""Closed-form speed profiles and look-ahead: ramps, rest to rest, corners one after the other."""
