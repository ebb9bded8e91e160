"""MCAP as a file format: records, chunks and indexes, whatever their messages mean."""
