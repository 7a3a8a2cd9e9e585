"""Which spot of an image is which LED of the pen."""
