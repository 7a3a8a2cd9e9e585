"""Tip, pen and camera from one swing and one length, without files."""
