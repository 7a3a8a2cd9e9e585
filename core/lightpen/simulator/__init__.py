"""The pen, its scene and its images, simulated: demo input and the tests' data."""
