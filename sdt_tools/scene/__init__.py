"""The simulated world: robot, operator, LiDAR, camera, scenarios."""
