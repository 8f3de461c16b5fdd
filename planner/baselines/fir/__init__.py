"""Paper 000: velocity pulses along straight legs, overlapped in time and filtered by two moving averages."""
