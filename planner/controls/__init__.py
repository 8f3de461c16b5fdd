"""Controls: programs for them, and machine files from their settings."""
