"""The LED file of a pen: its frame, its edits, and whether the images agree."""
