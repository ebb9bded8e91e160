"""An emulated network camera."""
