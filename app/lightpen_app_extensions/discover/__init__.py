"""Tip, pen and camera from a swing without files: captured, solved, saved."""
