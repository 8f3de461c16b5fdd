"""Motions by closed forms, which the papers give: FIR filters (000, 001) and look-ahead over corners
(003)."""
