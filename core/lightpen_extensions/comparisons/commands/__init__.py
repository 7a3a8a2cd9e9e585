"""The commands that compare calibrations, and the options they share with others."""
