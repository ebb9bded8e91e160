"""The real robot: what its devices say, and what they are told."""
