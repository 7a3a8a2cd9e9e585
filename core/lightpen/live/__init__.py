"""The images of a camera as they come, and a swing captured from them."""
