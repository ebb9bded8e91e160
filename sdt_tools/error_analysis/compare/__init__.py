"""Two models or more on the same frames: what got better, what worse, and on what condition."""
