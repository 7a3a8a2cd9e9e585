"""Live sources of images, and the worker that runs one in a thread of its own."""
