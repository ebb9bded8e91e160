"""The whole robot emulated: its LiDAR, its base and its camera in one simulated world, in real time."""
