"""Training of the vision network: the last layers on gestures, plainly or against the fast gradient sign."""
