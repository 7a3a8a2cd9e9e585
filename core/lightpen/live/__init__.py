"""The images of a camera as they come, each looked at and handed on."""
