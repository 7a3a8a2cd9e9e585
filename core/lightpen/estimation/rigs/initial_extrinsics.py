"""Extrinsics of a rig by the images alone, to start the fit from.

At a moment that two cameras see, the two poses of the pen give their relative pose. The
fit of a rig starts from there, as a wrong rig file or focal length would mislead it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.contact.single_images import PosedImages
from lightpen.estimation.rigs.synchrony import (
    PenRotations,
    TimeLag,
    measure_lag,
    require_same_moments,
)
from lightpen.model.rig import Rig
from lightpen.model.rigid import vector_from_rotation


@dataclass(frozen=True, eq=False)
class InitialExtrinsics:
    """The extrinsics of a rig by the images."""

    rig: Rig  # with the file's cameras, without a covariance
    # Of each camera but the first; None: not determined.
    lags: tuple[TimeLag | None, ...]
    apart: BoolArray  # (N, C), images not simultaneous with those of earlier cameras

    def deviations(self, file: Rig) -> FloatArray:
        """Return the deviations from a file's extrinsics, as in `Rig.covariance`."""
        turns = self.rig.rotations[1:] @ np.swapaxes(file.rotations[1:], 1, 2)
        shifts = self.rig.translations[1:] - file.translations[1:]
        return np.concatenate([vector_from_rotation(turns), shifts], axis=1).ravel()


def find_initial_extrinsics(
    rig: Rig, parts: Sequence[PosedImages]
) -> InitialExtrinsics:
    """Find the extrinsics by the images of each camera at the same N instants.

    Raises `CalibrationError` if too few moments are seen by two cameras, or the images
    are not of the same moments.
    """
    turns = [PenRotations.of(part) for part in parts]
    seen, cone = turns[0], parts[0].pivot.pivot_cam
    rotations, translations = rig.rotations.copy(), rig.translations.copy()
    lags: list[TimeLag | None] = [None] * rig.n_cameras
    apart = np.zeros((len(seen.known), rig.n_cameras), dtype=bool)
    left = list(range(1, rig.n_cameras))
    while left:
        c = max(left, key=lambda each: np.sum(seen.known & turns[each].known))
        left.remove(c)
        found = require_same_moments(seen, turns[c], rig.names[c])
        lags[c] = measure_lag(seen, found)
        apart[found.apart, c] = True
        rotations[c] = found.rotation
        # From the cone, as all images of a camera determine it, not from single poses.
        translations[c] = parts[c].pivot.pivot_cam - found.rotation @ cone
        seen = seen.completed(turns[c], found.rotation)
    placed = replace(
        rig, rotations=rotations, translations=translations, covariance=None
    )
    return InitialExtrinsics(placed, tuple(lags[1:]), apart)
