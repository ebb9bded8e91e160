"""When messages came: gaps, jitter, delay, drift, pairs; what they say of a recording, in words and as a picture."""
