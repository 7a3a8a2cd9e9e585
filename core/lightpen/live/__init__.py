"""The live pipeline: camera images, detections and their receivers."""
