"""A camera that OpenCV can open."""
