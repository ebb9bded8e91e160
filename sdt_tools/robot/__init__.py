"""The real robot: its sensors and its base."""
