"""Tip, pen and camera from one swing and one length, without a file of either."""
