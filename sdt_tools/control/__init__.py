"""Who drives: a network as a driver of the robot."""
