"""The tip from what all images show, its uncertainty, and what it is worth."""
