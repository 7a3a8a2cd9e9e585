"""Pose and tip of the pen, streamed live to programs that listen."""
