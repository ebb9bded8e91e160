"""What terminal apps are made of: scans and pictures drawn in characters, and a terminal that is too small."""
