"""Frames whose label is probably wrong: networks that never saw a recording are asked what its labels should be."""
