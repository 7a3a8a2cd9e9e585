"""Estimation of the tip and its uncertainty from all images."""
