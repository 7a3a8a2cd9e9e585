"""What one image shows: spots, which LED each is, the pose of the pen."""
