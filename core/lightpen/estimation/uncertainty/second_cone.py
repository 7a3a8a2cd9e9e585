"""A second swing in another cone at a certified distance: a length for the pen's scale.

One camera sees how the LEDs stand to each other, not how large the pen is. Two cones at
a known distance tell it: both swings are adjusted together, with one tip, one camera
and one pen, and the distance of the cones as one more observation.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.observations import Observations, without_copies
from lightpen.detection.reasons import Reason
from lightpen.estimation.bundle.adjustment import Adjustment
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.linearised import (
    N_CONE,
    BundleState,
    CameraView,
    eliminate,
    views_at,
)
from lightpen.estimation.bundle.priors import ConeSeparation
from lightpen.estimation.contact.joint import ContactModel, JointFit, fit_contact
from lightpen.estimation.contact.single_images import (
    pose_steadily,
    require_fit,
    without_field,
)
from lightpen.model.camera import Camera
from lightpen.model.coverage import COVERAGE_FACTOR, inverse
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector


@dataclass(frozen=True, eq=False)
class SecondSwing:
    """Observations of a swing in a second cone."""

    observations: Observations
    separation: ConeSeparation


@dataclass(frozen=True, eq=False)
class SecondImages:
    """The images of a second swing that agree on a tip, and their fit."""

    swing: SecondSwing
    reasons: tuple[Reason, ...]  # why an image of the swing is not among the M
    pixels: FloatArray  # (M, L, 2), px
    sigmas: FloatArray  # (M, L), of the centres by their detector, px
    joint: JointFit

    def joined(
        self, first: BundleState, pixels: FloatArray
    ) -> tuple[BundleState, FloatArray]:
        """Return start values and images of both swings.

        ``first`` and ``pixels`` (N, 1, L, 2), px, belong to the first swing.
        """
        numbers = [len(pixels), len(self.pixels)]
        state = replace(
            first,
            rotations=np.concatenate([first.rotations, self.joint.rotations]),
            at_second=np.repeat([False, True], numbers),
            between_rig=self.joint.cone_cam - first.cone_rig,
        )
        return state, np.concatenate([pixels, self.pixels[:, None]])


def second_images(camera: Camera, pen: Pen, swing: SecondSwing) -> SecondImages:
    """Return the images of a second swing that agree on a tip.

    Raises `CalibrationError` if they do not; the text says what is missing.
    """
    seen = without_field(camera, without_copies(swing.observations))
    steady = pose_steadily(camera, pen, seen)
    part = steady.posed
    pixels = steady.observations.pixels[part.chosen]
    joint = fit_contact(
        ContactModel.of(camera, pen, pixels),
        part.poses.of(part.kept).rotations,
        part.pivot.tip_pen,
        part.pivot.pivot_cam,
    )
    require_fit(joint.sigma, camera, pen, pixels)
    sigmas = steady.observations.sigmas[part.chosen]
    return SecondImages(swing, tuple(part.reasons), pixels, sigmas, joint)


@dataclass(frozen=True, eq=False)
class SecondCone:
    """What a second swing says of the pen's scale."""

    cone_cam: FloatArray  # (3,), cone point in the camera frame, mm
    swing: SecondSwing
    # Why an image of the second swing was left out; `Reason.NONE` for the used ones.
    reasons: tuple[Reason, ...]
    # (N,), root mean square residual of each image, px; NaN of those left out.
    rms: FloatArray
    leds_used: BoolArray  # (N, L)
    distance: float  # of the cones as they were adjusted, mm
    scale: float  # of the pen against its file, relative
    scale_uncertainty: float  # U (k = 2)

    @property
    def observations(self) -> Observations:
        """Observations of the second swing."""
        return self.swing.observations

    @property
    def separation(self) -> ConeSeparation:
        """Certified distance of the cones."""
        return self.swing.separation

    @property
    def n_used(self) -> int:
        """Number of used images of the second swing."""
        return self.reasons.count(Reason.NONE)


def second_cone(adjusted: Adjustment, images: SecondImages) -> SecondCone:
    """Return what a second swing says, whose images are the last adjusted."""
    bundle, at = adjusted.bundle, adjusted.bundle.layout.scale.start
    state, n = bundle.state, len(images.pixels)
    used, residuals = bundle.used[-n:, 0], bundle.residuals[-n:, 0]
    reasons = np.array(images.reasons, dtype=object)
    chosen = np.flatnonzero(reasons == Reason.NONE)
    reasons[chosen[~used.any(axis=1)]] = Reason.MISFIT
    leds_used = np.zeros((len(reasons), used.shape[1]), dtype=bool)
    leds_used[chosen] = used
    squares = np.full(leds_used.shape, np.nan)
    squares[chosen] = np.sum(residuals**2, axis=-1)
    n_leds = leds_used.sum(axis=1)
    totals = np.sum(squares, axis=1, where=leds_used)
    return SecondCone(
        cone_cam=state.cone_rig + state.between_rig,
        swing=images.swing,
        reasons=tuple(reasons),
        rms=np.sqrt(np.where(n_leds > 0, totals / np.maximum(n_leds, 1), np.nan)),
        leds_used=leds_used,
        distance=float(np.linalg.norm(state.between_rig)),
        scale=bundle.scale,
        scale_uncertainty=COVERAGE_FACTOR * float(np.sqrt(bundle.covariance[at, at])),
    )


# The common normal of the discs as an uncertain parameter.
#
# The centre of a disc's image deviates from the image of its centre, depending on the
# normal. The adjustment holds the normals fixed. The uncertainty by a common rotation
# of them is found with this rotation as a further unknown of the same equations.


TURN = 1e-3  # rad, of a difference


class NormalEffect(NamedTuple):
    """ImageField of a rotation of all normals on a bundle with fixed normals."""

    gain: FloatArray  # (p, 2), change of the unknowns per rad of rotation
    # (2, 2), of the images on the rotation, all else unknown, 1/rad^2.
    information: FloatArray

    def covariance(self, of_turn: FloatArray) -> FloatArray:
        """Return the covariance (p, p), from the turn's covariance (2, 2), rad^2."""
        return np.asarray(self.gain @ of_turn @ self.gain.T)


def effect_of_normals(bundle: Bundle) -> NormalEffect:
    """Return the first-order effect of a rotation of all normals, by one camera."""
    state, unknowns = bundle.state, bundle.unknowns
    there = np.zeros_like(bundle.residuals)
    view = views_at(state, there, unknowns.field_columns)[0]
    extended = with_normal(view, state).in_units_of(unknowns.noise[:, 0])
    jitter = bundle.components.jitter.covariance
    each = eliminate((extended,), bundle.used, bundle.weight_sigma, jitter)
    own_end = N_CONE + view.own.shape[-1]
    K, p0 = unknowns.mixing.shape
    mixing = np.zeros((K + 2, p0 + 2))
    old_rows = np.r_[0:own_end, own_end + 2 : K + 2]
    mixing[np.ix_(old_rows, np.arange(p0))] = unknowns.mixing
    mixing[own_end, p0] = mixing[own_end + 1, p0 + 1] = 1.0
    between = unknowns.layout.between
    layout = unknowns.layout._replace(
        between=slice(between.start + 2, between.stop + 2)
    )
    information, _ = replace(unknowns, mixing=mixing, layout=layout).system(each)
    old = np.r_[0:p0, p0 + 2 : len(information)]
    known = bundle.prior_information + bundle.measured_information
    turn = [p0, p0 + 1]
    coupling = information[np.ix_(old, turn)]
    gain = -inverse(information[np.ix_(old, old)] + known) @ coupling
    own = information[np.ix_(turn, turn)] + coupling.T @ gain
    return NormalEffect(gain, own)


def covariance_of_turn(pen: Pen) -> FloatArray | None:
    """Return what a pen states of the turn, (2, 2), rad^2; None if nothing."""
    if pen.normal_covariance is None:
        return None
    axes = across_normals(pen.normals)
    return np.asarray(axes @ pen.normal_covariance @ axes.T)


def with_normal(view: CameraView, state: BundleState) -> CameraView:
    """Return a view with two more columns of its own: turns of the normal, rad."""
    camera = state.rig.cameras[0]
    _, points, normals = state.leds_in(0)
    radius = state.pen.diameter / 2
    here = ellipse_centers(camera, points, normals, radius)
    columns = []
    for turn in TURN * np.eye(2):
        turned = turned_normals(state.pen.normals, turn)
        normals = turned @ np.swapaxes(state.rotations, 1, 2)
        there = ellipse_centers(camera, points, normals, radius)
        columns.append((there - here) / TURN)
    return replace(view, own=np.concatenate([view.own, np.stack(columns, -1)], axis=3))


def turned_normals(normals: FloatArray, turn: FloatArray) -> FloatArray:
    """Return normals (L, 3) turned about two axes across their mean, by (2,), rad."""
    axes = across_normals(normals)
    return np.asarray(normals @ rotation_from_vector((turn @ axes)[None])[0].T)


def across_normals(normals: FloatArray) -> FloatArray:
    """Return two axes, (2, 3), at right angles to the mean of normals."""
    return np.asarray(np.linalg.svd(normals.mean(axis=0)[None])[2][1:])
