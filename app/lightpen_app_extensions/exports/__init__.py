"""Tips for other programs in the window."""
