"""Devices played by a program, so that drivers can be tried without them, and with their faults."""
