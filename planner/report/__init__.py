"""What a plan tells: tables, figures, and files of trajectories, pulses and programs."""
