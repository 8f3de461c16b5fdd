"""Motions in time: integrated from a solution, looked at anywhere, sampled at the interpolation period."""
