"""New recordings made of old ones: parts, joins, and what is left when something is taken out."""
