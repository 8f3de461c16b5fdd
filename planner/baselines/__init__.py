"""Motions by the papers' closed forms: FIR filters (000, 001), look-ahead over corners (003)."""
