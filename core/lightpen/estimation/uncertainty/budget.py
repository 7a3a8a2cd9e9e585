"""Uncertainty budget of tip and cone: how U is computed.

All equations are those of method.md. The fit is linear about its solution: with the
information N of the images, L of the priors and M of other measurements, the unknowns
have the covariance P = (N + L + M)^-1, equation (14). `contributions_of` propagates
each source of error through P and adds up the covariances of (tip, cone), as the GUM
[2]_ combines independent components:

================  ========  ==========================================================
contribution      equation  source
================  ========  ==========================================================
noise             (15)      image noise, enlarged where it is correlated or scatters
seat              (15-17)   jitter, and waves beyond the form error
ball and cone     (17)      form error, assumed
drift             (17)      of cone against camera
led geometry      (17)      errors of the LED file, and a pen that bends
disc diameter     (16)      prior or measurement
camera            (16-17)   prior of the intrinsics; a camera that turns with the lean
lens              (17-18)   field of the lens; centres off alike in every posture
rig               (16)      prior of the extrinsics
================  ========  ==========================================================

Each is the error of the effective tip (`Bundle.effective`), in the scale of the LED
file: scale and temperature of the pen act when the tip measures.

Sizes of random effects are estimated from the images. One that is not significant is
not fitted, but budgeted by its expected variance, equation (6). Fields of the images
are averages over their sizes, equation (7). U = 2 sqrt(diag C) with the sum C, equation
(21).

Residuals of successive images are correlated. The factor on the noise follows from the
autoregression (`noise_correlation`), or from the scatter between blocks of consecutive
images (cluster-robust [1]_), equation (20), if that is significantly larger. Monte
Carlo trials check the whole law (the extension `comparisons`).

References
----------
.. [1] A. C. Cameron, D. L. Miller, "A practitioner's guide to cluster-robust
   inference", J. Human Resources 50 (2015) 317-372.
.. [2] JCGM 100:2008, "Guide to the expression of uncertainty in measurement", 5.1, 6.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import Adjustment
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.image_fields import MODE_COUNTS, FieldName
from lightpen.estimation.bundle.linearised import N_CONE, whole_moves
from lightpen.estimation.contact.joint import JointFit
from lightpen.estimation.uncertainty.disc_normals import (
    covariance_of_turn,
    effect_of_normals,
)
from lightpen.model.coverage import COVERAGE_FACTOR, chi_square_quantile, inverse

MAX_BLOCKS = 10
MIN_BLOCK_SIZE = 3
BY_CHANCE = 0.01  # probability that independent noise scatters blocks as much
POSTURES = 30  # number with independent errors of the centres
NEGLIGIBLE = 1e-5  # mm, of a standard uncertainty


class ContributionName(StrEnum):
    """Source of uncertainty of a tip."""

    NOISE = "noise"
    SEAT = "seat"
    FORM = "ball and cone"
    DRIFT = "drift"
    LEDS = "led geometry"
    DIAMETER = "disc diameter"
    CAMERA = "camera"
    METHOD = "method"  # its difference from the joint fit
    LENS = "lens"
    EXTRINSICS = "rig"


IMAGES_SHRINK = ContributionName.NOISE, ContributionName.SEAT, ContributionName.DRIFT


@dataclass(frozen=True, eq=False)
class UncertaintyContribution:
    """One part of the uncertainty."""

    name: ContributionName
    covariance: FloatArray  # (6, 6), of (tip_pen, cone_cam), mm^2
    assumed: bool = False  # whether a default value replaces what a file leaves out

    @property
    def standard_uncertainty(self) -> FloatArray:
        """Of the three coordinates of the tip, (3,), mm."""
        return np.sqrt(np.maximum(np.diag(self.covariance)[:3], 0.0))


@dataclass(frozen=True, eq=False)
class Budget:
    """Uncertainty budget of (tip_pen, cone_cam)."""

    # They add up to the covariance; negligible ones are left out.
    shares: tuple[UncertaintyContribution, ...]
    # (6, 6), from image noise as if it were independent between images, mm^2.
    independent_noise: FloatArray
    # Variance between blocks over that of independent noise and jitter; 1 on average.
    block_ratio: float
    # Of a coordinate's errors in successive images; 0 if not significant.
    autocorrelation: float
    correlation_factor: float  # factor on the covariance of independent noise

    @property
    def covariance(self) -> FloatArray:
        """Combined covariance of (tip_pen, cone_cam), (6, 6), mm^2."""
        return np.asarray(sum(share.covariance for share in self.shares))

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip_pen and cone_cam, (6,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance))

    @property
    def weakest_direction(self) -> FloatArray:
        """Unit vector of the pen frame along which the tip is most uncertain, (3,)."""
        _, vectors = np.linalg.eigh(self.covariance[:3, :3])
        weakest = vectors[:, -1]
        return np.asarray(weakest * np.sign(weakest[np.argmax(np.abs(weakest))]))

    @property
    def weakest_uncertainty(self) -> float:
        """U (k = 2) along the weakest direction, mm."""
        values = np.linalg.eigvalsh(self.covariance[:3, :3])
        return COVERAGE_FACTOR * float(np.sqrt(values[-1]))

    @property
    def largest_share(self) -> UncertaintyContribution:
        """The largest contribution along the weakest direction."""
        return max(self.shares, key=self.weakest_share)

    def weakest_share(self, share: UncertaintyContribution) -> float:
        """Return U (k = 2) of one share along the weakest direction, mm."""
        along = self.weakest_direction
        variance = float(along @ share.covariance[:3, :3] @ along)
        return COVERAGE_FACTOR * float(np.sqrt(max(variance, 0.0)))


@dataclass(frozen=True, eq=False)
class SplitHalfCheck:
    """Tip from the odd images against tip from the even ones."""

    difference: FloatArray  # (3,), odd minus even, pen frame, mm
    # (3,), U (k = 2) of the difference from image noise, mm
    expanded_uncertainty: FloatArray


def combine(adjustment: Adjustment, joint: JointFit) -> Budget:
    """Make the budget of an adjustment; ``joint`` is the joint fit at its estimate."""
    bundle, correlation = adjustment.bundle, adjustment.correlation
    ratio, blocks_count = _block_scatter(joint, bundle)
    raised = max(ratio / correlation.factor, 1.0) if blocks_count else 1.0
    n_images = int(bundle.used.any(axis=(1, 2)).sum())
    return Budget(
        shares=contributions_of(bundle, n_images, raised * correlation.noise),
        independent_noise=bundle.independent_noise,
        block_ratio=ratio,
        autocorrelation=correlation.coefficient,
        correlation_factor=raised * correlation.factor,
    )


def contributions_of(
    bundle: Bundle, n_images: float, noise: FloatArray
) -> tuple[UncertaintyContribution, ...]:
    """Return the contributions to the covariance of (tip, cone), equations (15)-(18).

    Parameters
    ----------
    n_images : float
        Images that take part.
    noise : (6, 6) array
        Covariance by image noise, mm^2.
    """
    at, priors = bundle.layout, bundle.unknowns.priors
    jitter = bundle.propagated(bundle.jitter_information + bundle.insignificant_jitter)
    moved, by_form = _of_seat(bundle, priors.form_error)
    drift = bundle.component_contribution(at.drift)
    drift *= drift_variance(bundle) / _prior_variance(bundle, at.drift)
    leds = bundle.component_contribution(at.leds) + _of_faces(bundle)
    leds += of_fields(bundle, FieldName.BEND)
    lens = center_errors(bundle, n_images) + of_fields(bundle, FieldName.LENS)
    camera = _of_cameras(bundle) + of_fields(bundle, FieldName.TILT)
    shares = [
        UncertaintyContribution(ContributionName.NOISE, noise),
        UncertaintyContribution(ContributionName.SEAT, jitter + moved),
        UncertaintyContribution(ContributionName.FORM, by_form, assumed=True),
        UncertaintyContribution(ContributionName.DRIFT, drift),
        UncertaintyContribution(ContributionName.LEDS, leds),
        UncertaintyContribution(
            ContributionName.DIAMETER, bundle.part(at.diameter), priors.diameter.assumed
        ),
        UncertaintyContribution(
            ContributionName.CAMERA,
            camera,
            any(camera.assumed for camera in priors.cameras),
        ),
        UncertaintyContribution(ContributionName.LENS, lens),
    ]
    if priors.extrinsics is not None:
        rig = bundle.part(at.extrinsics)
        shares.append(
            UncertaintyContribution(
                ContributionName.EXTRINSICS, rig, priors.extrinsics.assumed
            )
        )
    return tuple(
        share for share in shares if share.standard_uncertainty.max() > NEGLIGIBLE
    )


def center_errors(bundle: Bundle, n_images: float) -> FloatArray:
    """Return the covariance (6, 6) by errors of centres, independent by posture: (18).

    ``n_images`` take part.
    """
    bias = bundle.unknowns.priors.center_bias / bundle.sigma
    times = max(n_images / POSTURES, 1.0) * bias**2
    return np.asarray(times * bundle.independent_noise)


def _of_faces(bundle: Bundle) -> FloatArray:
    """Return the covariance (6, 6) by the LEDs' faces: normals, and domes."""
    covariance, reading = np.zeros((6, 6)), bundle.unknowns.priors.reading
    if reading is not None:
        along_normals = reading.shift * _by_shift_along_normals(bundle)
        covariance += np.outer(along_normals, along_normals)
    of_turn = covariance_of_turn(bundle.unknowns.start.pen)
    if of_turn is not None and bundle.state.rig.n_cameras == 1:
        by_turn = bundle.effective @ effect_of_normals(bundle).gain
        covariance += by_turn @ of_turn @ by_turn.T
    return covariance


def _of_cameras(bundle: Bundle) -> FloatArray:
    """Return the covariance (6, 6) by the intrinsics of the cameras."""
    at, priors = bundle.layout.cameras, bundle.unknowns.priors.cameras
    covariance = bundle.part(*at)
    for place, prior in zip(at, priors, strict=True):
        if prior.beyond is not None:
            gain = bundle.gain[:, place] @ bundle.prior_information[place, place]
            covariance = covariance + gain @ prior.beyond @ gain.T
    return covariance


def of_fields(bundle: Bundle, name: FieldName) -> FloatArray:
    """Return the covariance (6, 6) by fields: at each size, and by what size it is."""
    covariance = np.zeros((6, 6))
    for field, place, found in zip(
        bundle.unknowns.fields,
        bundle.layout.fields,
        bundle.components.fields,
        strict=True,
    ):
        if field.name is name:
            both = bundle.gain[:, place]
            gain = both @ bundle.prior_information[place, place]
            covariance += gain @ found.covariance @ gain.T
            by_field = both @ inverse(bundle.covariance[place, place])
            covariance += by_field @ found.spread @ by_field.T
    return covariance


def seat_covariance(bundle: Bundle) -> FloatArray:
    """Return the budgeted covariance of the seat's moves by modes, (21, 21), mm^2."""
    seat = bundle.budget_components.seat
    likely = [form.expected_sigma for form in seat]
    form_error = bundle.unknowns.priors.form_error
    variances = [
        max(form.sigma, form_error, expected) ** 2
        for form, expected in zip(seat, [max(likely), *likely[1:]], strict=True)
    ]
    return _by_forms(variances)


def drift_variance(bundle: Bundle) -> float:
    """Return the budgeted variance of the drift over the whole swing, mm^2."""
    return max(
        _prior_variance(bundle, bundle.layout.drift),
        bundle.budget_components.drift.expected_sigma**2,
    )


def _of_seat(bundle: Bundle, form_error: float) -> tuple[FloatArray, FloatArray]:
    """Return covariances (6, 6) by seat modes: beyond the form error, and by it."""
    at = bundle.layout.whole_seat
    gain = bundle.gain[:, at] @ bundle.prior_information[at, at]
    known = _by_forms([form_error**2] * len(MODE_COUNTS))
    moved = gain @ (seat_covariance(bundle) - known) @ gain.T
    return moved, gain @ known @ gain.T


def _by_forms(variances: Sequence[float]) -> FloatArray:
    """Return the covariance (21, 21) of seat modes by the variance of each kind."""
    return np.diag(np.repeat(variances, N_CONE * np.array(MODE_COUNTS)))


def _by_shift_along_normals(bundle: Bundle) -> FloatArray:
    """Return the error of (tip, cone) by a shift of all LEDs along their normals, (6,).

    In mm by mm.
    """
    pen, tip = bundle.unknowns.start.pen, bundle.state.tip_pen
    moves = pen.normals.ravel()
    shift, turn = np.linalg.lstsq(whole_moves(pen.leds), moves, rcond=None)[0].reshape(
        2, 3
    )
    at, shape = bundle.layout.leds, bundle.unknowns.basis.T @ moves
    off = -bundle.gain[:, at] @ bundle.prior_information[at, at] @ shape
    # A move of the whole pen is no error of its LEDs but moves the tip.
    off[:3] += np.cross(turn, pen.leds.mean(axis=0) - tip) - shift
    return np.asarray(off)


def _prior_variance(bundle: Bundle, at: slice) -> float:
    """Return the budgeted variance of unknowns of one kind, mm^2."""
    return 1 / float(bundle.budget_prior[at.start, at.start])


def compare_halves(joint: JointFit) -> SplitHalfCheck:
    """Compare the tip by odd images with the tip by even images."""
    steps, covariances = [], []
    for first in (0, 1):
        S = joint.information[first::2].sum(axis=0)
        steps.append(np.linalg.solve(S, joint.gradients[first::2].sum(axis=0)))
        covariances.append(np.linalg.inv(S))
    variances = np.diag(covariances[0] + covariances[1])[:3]
    return SplitHalfCheck(
        difference=(steps[0] - steps[1])[:3],
        expanded_uncertainty=COVERAGE_FACTOR * np.sqrt(variances),
    )


def _block_scatter(joint: JointFit, bundle: Bundle) -> tuple[float, bool]:
    """Return the ratio of equation (20), and whether it is significant.

    Seat modes, drift and jitter are contributions of their own and taken out.
    """
    n_images = len(joint.information)
    n_blocks = min(MAX_BLOCKS, n_images // MIN_BLOCK_SIZE)
    if n_blocks < 3:
        return 1.0, False
    noise = joint.covariance
    by_cone = joint.information[..., N_CONE:]
    moved = np.einsum("nik,nk->ni", by_cone, bundle.cone_moves[:n_images])
    gradients = joint.gradients - moved
    scores = np.array(
        [part.sum(axis=0) for part in np.array_split(gradients, n_blocks)]
    )
    scores -= scores.mean(axis=0)
    scatter = scores.T @ scores * n_blocks / (n_blocks - 1)
    ratio = float(np.trace(noise @ scatter)) / 6
    jitter = bundle.components.jitter.covariance
    if jitter is not None:
        shaken = np.einsum("nik,kl,njl->ij", by_cone, jitter, by_cone, optimize=True)
        ratio /= 1 + float(np.trace(noise @ shaken)) / 6
    n_free = 6 * (n_blocks - 1)
    return ratio, ratio > chi_square_quantile(n_free, BY_CHANCE) / n_free
