"""Detection in one image: spots, their labels, the pose of the pen."""
