"""Verdicts on safety domains: proved, broken or open, kept in a ledger and exported for other verifiers to check."""
