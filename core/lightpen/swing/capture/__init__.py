"""Rules of a capture: what an image changes, as pure functions of frozen values."""
