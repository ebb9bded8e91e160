"""The cockpit: what the robot sees and does, and the keys that drive it, in a terminal."""
