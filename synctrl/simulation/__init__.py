"""What then happens: the plant, the closed loop in time, results."""
