"""Learning from data sets: schedules and one loop."""
