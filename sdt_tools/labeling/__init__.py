"""Label journals: append-only, one row an act."""
