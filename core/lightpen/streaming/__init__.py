"""Live streaming of pose and tip to other programs."""
