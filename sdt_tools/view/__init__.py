"""Rerun: what was recorded, predicted and tagged, on one timeline."""
