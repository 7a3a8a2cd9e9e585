"""A rig: cameras fixed to each other that see the same pen.

The first camera is the reference: its frame is the frame of the rig. One camera alone
is a rig of one.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.messages import Message, message
from lightpen.model.camera import Camera


@dataclass(frozen=True, eq=False)
class Rig:
    """Cameras and their poses (cam_from_rig, as in COLMAP [1]_).

    References
    ----------
    .. [1] J. L. Schonberger, J.-M. Frahm, "Structure-from-motion revisited", CVPR 2016.
    """

    cameras: tuple[Camera, ...]  # C of them
    rotations: FloatArray  # (C, 3, 3), of cam_from_rig; the first is the identity
    translations: FloatArray  # (C, 3), of cam_from_rig, mm; the first is zero
    # (6 (C - 1), 6 (C - 1)), of the rotation vectors (left, rad) and translations (mm)
    # of all but the first camera, in this order camera by camera
    covariance: FloatArray | None = None
    names: tuple[str, ...] = ()  # for display; empty for a single camera

    @property
    def n_cameras(self) -> int:
        """Number of cameras."""
        return len(self.cameras)


def rig_of(camera: Camera) -> Rig:
    """Return the rig of one camera alone."""
    return Rig((camera,), np.eye(3)[None], np.zeros((1, 3)))


def from_first(rig: Rig) -> Rig:
    """Return a rig without covariance, expressed in the frame of its first camera."""
    rotations = rig.rotations @ rig.rotations[0].T
    translations = rig.translations - rotations @ rig.translations[0]
    rotations[0], translations[0] = np.eye(3), 0.0  # exactly, whatever was rounded
    return replace(rig, rotations=rotations, translations=translations)


def of_camera(name: str, fault: Message) -> Message:
    """Return an error of a camera of a rig, with the camera's name."""
    return message("rig.of-camera", camera=name, fault=fault)
