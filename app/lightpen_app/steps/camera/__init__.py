"""The step Camera: source, exposure, intrinsics, stray light."""
