"""What this computer has of all that the rest needs: looked at without changing any of it."""
