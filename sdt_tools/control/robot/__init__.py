"""The real robot at work: its devices open, what keeps it safe between them and whoever drives, driven and recorded."""
