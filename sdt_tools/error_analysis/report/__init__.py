"""What an analysis says: one document, a table of tags, figures."""
