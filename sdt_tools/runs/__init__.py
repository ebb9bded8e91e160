"""Units of work: inputs hashed, finished atomically, skipped when valid, mapped over processes."""
