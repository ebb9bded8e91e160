"""Conditions that errors gather in: found on some recordings, confirmed on others."""
