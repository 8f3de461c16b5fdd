"""The output of a plan: tables, figures, and files of trajectories, pulses and programs."""
