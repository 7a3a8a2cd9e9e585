"""A swing without a tip: its causes and the residuals of its images."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.causes import UNKNOWN_CAUSE
from lightpen.detection.rig_pose import fit_rig_poses
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.messages import Message, message
from lightpen.swing.capture.kept_images import AcceptedImages
from lightpen.swing.capture.state import SwingSetup
from lightpen.swing_messages import Code


@dataclass(frozen=True, eq=False)
class FailedSwing:
    """Reason of a failed solution, and the fit of the LEDs in each image alone."""

    causes: tuple[Message, ...]  # the most evident one first
    pixels: FloatArray  # (N, C, L, 2), LED centres, px; NaN where one was not seen
    residuals: FloatArray  # (N, C, L, 2), from the pose of each moment, px


def failed_swing(setup: SwingSetup, kept: AcceptedImages, why: Message) -> FailedSwing:
    """Return a swing that gave no tip.

    Residuals of the poses do not depend on the cone. Where they are above the usual
    ones, a file or an LED is a likelier cause than the seat.
    """
    residuals = np.full_like(kept.pixels, np.nan)
    if len(kept):
        poses = fit_rig_poses(
            setup.rig, setup.pen, kept.pixels, kept.rotations, kept.translations
        )
        residuals = poses.residuals.reshape(kept.pixels.shape)
    sigma = float(np.median(kept.sigmas)) if len(kept) else 0.0
    fits = sigma <= USUAL_SIGMA
    causes = (
        (why,)
        if fits
        else (
            message(
                Code.LEDS_MISFIT, sigma=sigma, usual=USUAL_SIGMA, cause=UNKNOWN_CAUSE
            ),
            why,
        )
    )
    return FailedSwing(causes, kept.pixels, residuals)
