"""The whole pipeline on the scene, small: from recordings to a report of why frames are wrong."""
