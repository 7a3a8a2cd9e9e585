"""Several cameras: extrinsics, conventions, synchrony and common pen poses."""
