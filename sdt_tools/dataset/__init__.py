"""From recordings and labels to frames that a network learns from."""
