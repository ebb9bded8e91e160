"""The networks, their preprocessing, and how they are kept on disk."""
