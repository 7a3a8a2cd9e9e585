"""Tips for other programs."""
