"""The prices of limits, and which of them are active; the closed-form speed at corners."""
