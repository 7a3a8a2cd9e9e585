"""The uncertainty that a growing swing has reached, and can reach with its files.

During a swing tip and cone are fitted with the files held as they are. What the files
leave open belongs to the uncertainty all the same: it is that of the bundle adjustment
(`lightpen.estimation.bundle`), linearised where the joint fit stands.
"""

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.joint import JointFit
from lightpen.estimation.linearised import BundleState, eliminate, views_at
from lightpen.estimation.priors import priors_of
from lightpen.estimation.uncertainty import COVERAGE_FACTOR
from lightpen.estimation.unknowns import (
    FORMS,
    NO_COMPONENTS,
    Forms,
    Unknowns,
    drift_forms,
    inverse,
)
from lightpen.model.assumptions import USUAL
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rig import rig_of

GROWTH = 1.25  # of the number of images, after which all are counted anew
ENDLESS = 1e6  # times the images, for what no image can lower


@dataclass(frozen=True)
class Reached:
    """How certain a tip is, and can become.

    Attributes
    ----------
    uncertainty : float
        U (k = 2) along the weakest direction, mm; infinite until it is known.
    floor : float
        What more images of this kind cannot bring it below, mm: what the LED file
        leaves open, as the images themselves tell of the camera.
    """

    uncertainty: float = float("inf")
    floor: float = 0.0


NOT_REACHED = Reached()


@dataclass(frozen=True, eq=False)
class Reach:
    """What the images of a swing say of all that they depend on.

    Attributes
    ----------
    information : (K, K) array
        As `Eliminated.N`, for a noise of 1 px.
    n_images : int
        Images in it.
    n_whole : int
        Images in it that were counted together, where one fit has them.
    """

    information: FloatArray
    n_images: int
    n_whole: int

    def reached(self, camera: Camera, pen: Pen, sigma: float) -> Reached:
        """Return how certain the tip is by these images, and can become.

        Parameters
        ----------
        sigma : float
            Noise of one image coordinate, px.
        """
        rig = rig_of(camera)
        state = BundleState(rig, pen, np.zeros(3), np.zeros(3), np.empty((0, 3, 3)))
        forms = Forms(np.empty((0, sum(FORMS))), drift_forms(0))
        unknowns = Unknowns.of(state, priors_of(rig, pen, USUAL), forms)
        mixing = unknowns.mixing
        n = mixing.shape[1]
        prior = unknowns.prior_information(NO_COMPONENTS)[:n, :n]
        known = mixing.T @ self.information @ mixing / sigma**2
        now, at_last = (
            float(np.linalg.eigvalsh(inverse(times * known + prior)[:3, :3])[-1])
            for times in (1.0, ENDLESS)
        )
        return Reached(COVERAGE_FACTOR * sqrt(now), COVERAGE_FACTOR * sqrt(at_last))


def reach_of(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    joint: JointFit,
    before: Reach | None = None,
) -> Reach:
    """Return what images say, with that of all but the last ones where it is known.

    Parameters
    ----------
    pixels : (N, L, 2) array
        px; NaN where an LED was not seen.
    joint : JointFit
        The fit to them.
    before : Reach or None
        Of the first of these images.
    """
    n_images = len(pixels)
    if before is None or n_images > GROWTH * before.n_whole:
        return Reach(_counted(camera, pen, pixels, joint, 0), n_images, n_images)
    fresh = _counted(camera, pen, pixels, joint, before.n_images)
    return replace(before, information=before.information + fresh, n_images=n_images)


def _counted(
    camera: Camera, pen: Pen, pixels: FloatArray, joint: JointFit, first: int
) -> FloatArray:
    state = BundleState(
        rig_of(camera), pen, joint.tip_pen, joint.cone_cam, joint.rotations[first:]
    )
    views = views_at(state, pixels[first:, None])
    return eliminate(views, joint.used[first:, None], 1.0).N
