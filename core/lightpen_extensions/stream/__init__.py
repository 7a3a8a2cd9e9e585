"""Pose and tip for other programs, live."""
