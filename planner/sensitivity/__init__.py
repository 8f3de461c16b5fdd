"""What limits cost and which of them are active; the closed-form speed at corners."""
