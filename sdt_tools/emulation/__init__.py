"""Devices that are not there: what the robot's drivers talk to where no robot is at hand."""
