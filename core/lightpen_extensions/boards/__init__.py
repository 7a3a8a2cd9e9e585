"""Calibration of one camera, or of two together, with views of a board."""
