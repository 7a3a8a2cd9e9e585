"""A swing as it happens: its states, the next posture, the record on disk."""
