"""Why is this frame wrong: definitions, neighbours, conditions, tags, report."""
