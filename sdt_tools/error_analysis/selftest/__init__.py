"""Errors of known cause, planted into predictions, and how well they are found again."""
