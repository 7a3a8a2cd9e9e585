"""The step Review: the verdict, the tip and every image."""
