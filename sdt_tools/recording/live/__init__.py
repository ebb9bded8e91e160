"""Recording as it happens: the loop, who drives, what is missing."""
