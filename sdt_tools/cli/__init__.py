"""The command line: one file a verb; the only place where parts are plugged together."""
