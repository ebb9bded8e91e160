"""The app in which people label: the state and what keys do to it, the journal under it, the screen above it."""
