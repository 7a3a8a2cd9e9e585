"""Guidance during a swing of a pen that was found by its first images."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.model.coverage import N_DIRECTIONS, dial_counts
from lightpen.model.information import inverse
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.model.posture import Posture
from lightpen.swing.capture.guidance import GuidanceInput, next_posture, visible_fields
from lightpen.swing.capture.shortfall import turn_range
from lightpen_extensions.discover.found import Discovery

N_PER_FIELD = 3  # images
TURNS_NEEDED = (-0.35, 0.35)  # rad, about the pen's own axis


@dataclass(frozen=True, eq=False)
class Guide:
    """Postures of a swing so far, and what is missing."""

    outlook: GuidanceInput  # as found, with the postures of the images so far
    # (3, 8), images wanted in each field of the dial; none where the LEDs are not seen
    needed: IntArray
    target: Posture | None = None  # next posture; None once none is missing

    @property
    def pen(self) -> Pen:
        """The pen as found."""
        return self.outlook.pen

    @property
    def counts(self) -> IntArray:
        """Images by field of the dial, (3, 8); upright in the first column."""
        return dial_counts(self.outlook.rotations)

    @property
    def turns(self) -> tuple[float, float] | None:
        """Least and greatest turn of the pen about its own axis, rad."""
        return turn_range(self.pen, self.outlook.rotations)

    @property
    def is_complete(self) -> bool:
        """Whether every field has its images, and the pen was turned enough."""
        turns = self.turns or (0.0, 0.0)
        is_turned = turns[0] <= TURNS_NEEDED[0] and turns[1] >= TURNS_NEEDED[1]
        return is_turned and bool((self.counts >= self.needed).all())

    def with_postures(self, new: FloatArray) -> Self:
        """Return the guide after images with rotations (M, 3, 3), cam_from_pen."""
        rotations = np.concatenate([self.outlook.rotations, new])
        after = replace(self, outlook=replace(self.outlook, rotations=rotations))
        missing = after.counts < self.needed
        target = None
        if missing.any():
            target = next_posture(after.outlook, new[-1], missing)
        return replace(after, target=target)


def guide_of(found: Discovery) -> Guide:
    """Return the guide by the images that a discovery is of."""
    calibration = found.calibration
    state, joint = calibration.bundle.state, calibration.joint
    outlook = GuidanceInput(
        rig=state.rig,
        pen=state.pen,
        tip_pen=joint.tip_pen,
        cone_cam=joint.cone_cam,
        information=inverse(calibration.bundle.covariance[:6, :6]),
        sigma=calibration.bundle.sigma,
        rotations=joint.rotations,
        spacing=SwingLimits().spacing,
    )
    needed = np.full((3, N_DIRECTIONS), N_PER_FIELD, dtype=np.int64)
    needed[0] = 0  # a hand that swings is hardly upright
    return Guide(outlook, needed * visible_fields(outlook))
