"""The step LEDs: the geometry file, checked and matched with live images."""
