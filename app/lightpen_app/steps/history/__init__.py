"""The step History."""
