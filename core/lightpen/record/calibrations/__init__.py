"""Calibration records: read back, stated, recomputed."""
