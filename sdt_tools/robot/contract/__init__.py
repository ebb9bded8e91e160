"""The contract of the robot's devices, as rules that a driver is held against while it works."""
