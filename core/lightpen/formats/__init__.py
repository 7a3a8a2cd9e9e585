"""Read and write files of cameras, pens, LED centres and poses."""
