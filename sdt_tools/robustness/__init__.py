"""Safety domains and what can be proved or attacked in them."""
