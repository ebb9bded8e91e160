"""Closed-loop runs of a model over scenarios, many scenes at once."""
