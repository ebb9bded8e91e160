"""An emulated Pioneer P3-AT."""
