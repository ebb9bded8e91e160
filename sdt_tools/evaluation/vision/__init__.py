"""Closed-loop runs of the whole controller: what a vision network misreads, and what comes of it."""
