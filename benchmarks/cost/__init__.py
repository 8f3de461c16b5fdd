"""What planning takes: time and memory."""
