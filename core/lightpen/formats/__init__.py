"""Files of cameras, pens, LED centres and poses, read with care and written whole."""
