"""A model over recordings: one prediction a frame."""
