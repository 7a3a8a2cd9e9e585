"""The words of the problem: camera, pen, pose, posture; no files, no threads."""
