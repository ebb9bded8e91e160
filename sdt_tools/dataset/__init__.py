"""Recordings and journals, made into data sets."""
