"""Parquet, one file a topic, in and out."""
