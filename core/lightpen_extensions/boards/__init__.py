"""Camera calibration with boards."""
