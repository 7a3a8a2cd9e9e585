"""Every calibration that was ever accepted, refused or abandoned, entry by entry."""
