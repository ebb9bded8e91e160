"""The Pioneer P3-AT base, over ARCOS."""
