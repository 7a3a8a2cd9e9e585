"""Assignment of the spots of an image to the LEDs of the pen."""
