"""Cameras that stand fast beside each other and see the same pen.

The first camera is the reference: its frame is the frame of the rig. One camera alone
is a rig of one.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera


@dataclass(frozen=True, eq=False)
class Rig:
    """Cameras and where they stand (cam_from_rig, as COLMAP [1]_ names it).

    Attributes
    ----------
    cameras : tuple of Camera
        C of them.
    rotations : (C, 3, 3) array
        Of cam_from_rig; the first is the identity.
    translations : (C, 3) array
        Of cam_from_rig, mm; the first is zero.
    covariance : (6 (C - 1), 6 (C - 1)) array or None
        Of the rotation vectors (left, rad) and translations (mm) of all but the first
        camera, in this order camera by camera.

    References
    ----------
    .. [1] J. L. Schonberger, J.-M. Frahm, "Structure-from-motion revisited", CVPR 2016.
    """

    cameras: tuple[Camera, ...]
    rotations: FloatArray
    translations: FloatArray
    covariance: FloatArray | None = None

    @property
    def n_cameras(self) -> int:
        """Number of cameras."""
        return len(self.cameras)


def rig_of(camera: Camera) -> Rig:
    """Return the rig of one camera alone."""
    return Rig((camera,), np.eye(3)[None], np.zeros((1, 3)))
