"""Basic types: camera, pen, pose, posture, limits; no files, no threads."""
