"""MCAP recordings: written, read, inspected, imported."""
