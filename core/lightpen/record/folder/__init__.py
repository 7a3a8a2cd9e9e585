"""The data folder: verifications, camera calibrations, presence, clean-up."""
