"""Simulation of pen, scene and images, for the demo and the tests."""
