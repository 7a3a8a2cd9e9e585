"""Simulated swings."""
