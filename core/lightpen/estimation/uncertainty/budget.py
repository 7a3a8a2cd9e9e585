"""Uncertainty budget of tip and cone: how U is computed.

All equations are those of method.md. The fit is linear about its solution: with the
information N of the images, L of the priors and M of other measurements, the unknowns
have the covariance P = (N + L + M)^-1, equation (14). `contributions_of` propagates
each source of error through P and adds up the covariances of (tip, cone), as the GUM
[2]_ combines independent components:

=================  ========  =========================================================
contribution       equation  source
=================  ========  =========================================================
noise              (15)      image noise, enlarged where it is correlated or scatters
led centres        (18)      errors of centres that repeat with the posture
seat               (15-17)   jitter, and waves beyond the form error
ball and cone      (17)      form error, assumed
drift              (17)      of cone against camera
led geometry       (17)      errors of the LED file
pen scale, temperature, cone distance, disc diameter, camera, rig
                   (16)      prior or measurement of each
lens, compliance, loose stylus, sag, camera tilt, timing
                   (17)      effects of the station (`effects`)
not followed       (19)      shift of the estimate by shrinkage of assumed priors
=================  ========  =========================================================

Sizes of random effects are estimated from the images. One that is not significant is
not fitted, but budgeted by its expected variance, equation (6). U = 2 sqrt(diag C) with
the sum C, equation (21).

Residuals of successive images are correlated. The factor on the noise follows from the
autoregression (`noise_correlation`), or from the scatter between blocks of consecutive
images (cluster-robust [1]_), equation (20), if that is significantly larger. Monte
Carlo trials check the whole law (`lightpen.estimation.monte_carlo`).

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
from lightpen.estimation.bundle.effect_search import SearchedEffect
from lightpen.estimation.bundle.effects import MECHANICS, EffectName
from lightpen.estimation.bundle.linearised import N_CONE
from lightpen.estimation.bundle.priors import Priors
from lightpen.estimation.bundle.seat_modes import MODE_COUNTS, axes_of_cone
from lightpen.estimation.bundle.unknowns import whole_moves
from lightpen.estimation.contact.joint import JointFit
from lightpen.estimation.uncertainty.disc_normals import (
    covariance_of_turn,
    effect_of_normals,
)
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.quantiles import chi_square_quantile

MAX_BLOCKS = 10
MIN_BLOCK_SIZE = 3
BY_CHANCE = 0.01  # probability that independent noise scatters blocks as much
POSTURES = 30  # number with independent errors of the centres
# A seat mode of one wave is hardly observable beside the tip. Along the cone it is
# budgeted with this share of the other modes' deviation, as a ball or cone that is not
# round moves the tip sideways, and little up and down. `./run bench files` shows both.
ALONG = 0.4
NEGLIGIBLE = 1e-5  # mm, of a standard uncertainty


class ContributionName(StrEnum):
    """Source of uncertainty of a tip."""

    NOISE = "noise"
    CENTERS = "led centres"  # errors that repeat with the posture
    SEAT = "seat"
    FORM = "ball and cone"
    DRIFT = "drift"
    LEDS = "led geometry"
    SCALE = "pen scale"
    TEMPERATURE = "temperature"
    DISTANCE = "cone distance"
    DIAMETER = "disc diameter"
    CAMERA = "camera"
    EXTRINSICS = "rig"
    METHOD = "method"  # its difference from the joint fit
    LENS = "lens"
    COMPLIANCE = "compliance"
    LOOSE = "loose stylus"
    SAG = "sag"
    TILT = "camera tilt"
    TIMING = "timing"
    SHRINKAGE = "not followed"  # assumed priors beyond the shrunk ones


SHARES_OF_EFFECTS = {
    EffectName.LENS: ContributionName.LENS,
    EffectName.COMPLIANCE: ContributionName.COMPLIANCE,
    EffectName.LOOSE: ContributionName.LOOSE,
    EffectName.SAG: ContributionName.SAG,
    EffectName.TILT: ContributionName.TILT,
    EffectName.DELAY: ContributionName.TIMING,
    EffectName.SHUTTER: ContributionName.TIMING,
    EffectName.STROBE: ContributionName.TIMING,
}
ASSUMED_EFFECTS = {SHARES_OF_EFFECTS[name] for name in MECHANICS}
IMAGES_SHRINK = (
    ContributionName.NOISE,
    ContributionName.CENTERS,
    ContributionName.SEAT,
    ContributionName.DRIFT,
    ContributionName.SHRINKAGE,
    ContributionName.LOOSE,
    ContributionName.SAG,
    ContributionName.TILT,
    ContributionName.TIMING,
)


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
    # (6, 6), from the scatter between blocks of consecutive images, all but tip and
    # cone held, mm^2; None with too few images.
    blocks: FloatArray | None
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
    bundle, correlation = adjustment.whole, adjustment.correlation
    blocks, ratio, blocks_count = _block_scatter(joint, adjustment.bundle)
    raised = max(ratio / correlation.factor, 1.0) if blocks_count else 1.0
    n_images = int(bundle.used.any(axis=(1, 2)).sum())
    return Budget(
        shares=contributions_of(
            bundle,
            adjustment.priors,
            n_images,
            noise=raised * correlation.noise,
            shift=adjustment.shift_from(bundle),
            effects=adjustment.effects,
            estimate=adjustment.bundle,
        ),
        independent_noise=bundle.independent_noise,
        blocks=blocks,
        block_ratio=ratio,
        autocorrelation=correlation.coefficient,
        correlation_factor=raised * correlation.factor,
    )


def contributions_of(
    bundle: Bundle,
    priors: Priors,
    n_images: float,
    noise: FloatArray,
    shift: FloatArray,
    effects: Sequence[SearchedEffect] = (),
    estimate: Bundle | None = None,
) -> tuple[UncertaintyContribution, ...]:
    """Return the contributions to the covariance of (tip, cone), equations (15)-(19).

    Parameters
    ----------
    bundle : Bundle
        Adjustment with unshrunk priors and all mechanics.
    n_images : float
        Images that take part.
    noise : (6, 6) array
        Covariance by image noise, mm^2.
    shift : (6,) array
        Of the estimate from that adjustment, mm.
    effects : sequence of SearchedEffect
        Beside the fit.
    estimate : Bundle, optional
        Adjustment with shrunk priors, moved by errors of the centres that repeat; the
        other unless given.
    """
    at, estimate = bundle.layout, estimate or bundle
    jitter = bundle.propagated(bundle.jitter_information + bundle.insignificant_jitter)
    moved, by_form = _of_seat(bundle, priors.form_error)
    drift = bundle.component_contribution(at.drift)
    drift *= drift_variance(bundle) / _prior_variance(bundle, at.drift)
    # Equation (18): errors of the centres, independent from posture to posture.
    biased = max(n_images / POSTURES, 1.0) * estimate.independent_noise
    biased *= (priors.center_bias / estimate.sigma) ** 2
    if priors.reading is not None:
        along_normals = priors.reading.shift * _by_shift_along_normals(estimate)
        biased += np.outer(along_normals, along_normals)
    of_turn = covariance_of_turn(estimate.unknowns.start.pen)
    if of_turn is not None and estimate.state.rig.n_cameras == 1:
        biased += effect_of_normals(estimate).covariance(of_turn)[:6, :6]
    size = bundle.part(at.scale)
    warm = float(priors.temperature.covariance[0, 0] / priors.size_covariance[0, 0])
    shares = [
        UncertaintyContribution(ContributionName.NOISE, noise),
        UncertaintyContribution(ContributionName.CENTERS, biased, assumed=True),
        UncertaintyContribution(ContributionName.SEAT, jitter + moved),
        UncertaintyContribution(ContributionName.FORM, by_form, assumed=True),
        UncertaintyContribution(ContributionName.DRIFT, drift),
        UncertaintyContribution(
            ContributionName.LEDS, bundle.component_contribution(at.leds)
        ),
        UncertaintyContribution(
            ContributionName.SCALE, (1 - warm) * size, priors.scale.assumed
        ),
        UncertaintyContribution(
            ContributionName.TEMPERATURE, warm * size, priors.temperature.assumed
        ),
        UncertaintyContribution(ContributionName.DISTANCE, bundle.part(at.between)),
        UncertaintyContribution(
            ContributionName.DIAMETER, bundle.part(at.diameter), priors.diameter.assumed
        ),
        UncertaintyContribution(
            ContributionName.CAMERA,
            bundle.part(*at.cameras),
            any(camera.assumed for camera in priors.cameras),
        ),
    ]
    if priors.extrinsics is not None:
        rig = bundle.part(at.extrinsics)
        shares.append(
            UncertaintyContribution(
                ContributionName.EXTRINSICS, rig, priors.extrinsics.assumed
            )
        )
    shares += _of_effects(bundle, effects)
    shares.append(
        UncertaintyContribution(ContributionName.SHRINKAGE, np.outer(shift, shift))
    )
    return tuple(
        share for share in shares if share.standard_uncertainty.max() > NEGLIGIBLE
    )


def _of_effects(
    bundle: Bundle, effects: Sequence[SearchedEffect]
) -> list[UncertaintyContribution]:
    """Return the shares of effects: of those fitted, and of those held at 0."""
    parts = [
        (each.effect.name, each.covariance) for each in effects if not each.is_candidate
    ]
    for effect, place, found in zip(
        bundle.unknowns.effects,
        bundle.layout.effects,
        bundle.components.effects,
        strict=True,
    ):
        budgeted = found.covariance if found.sigma > 0 else found.expected
        gain = bundle.covariance[:6, place] @ bundle.prior_information[place, place]
        parts.append((effect.name, gain @ budgeted @ gain.T))
    shares = []
    for share in dict.fromkeys(SHARES_OF_EFFECTS.values()):
        own = (part for name, part in parts if SHARES_OF_EFFECTS[name] is share)
        covariance = sum(own, np.zeros((6, 6)))
        assumed = share in ASSUMED_EFFECTS
        shares.append(UncertaintyContribution(share, covariance, assumed))
    return shares


def seat_covariance(bundle: Bundle) -> FloatArray:
    """Return the budgeted covariance of the seat's moves by modes, (21, 21), mm^2."""
    seat, oval = bundle.budget_components.seat, bundle.budget_components.oval
    likely = [form.expected_sigma for form in seat]
    form_error = bundle.unknowns.priors.form_error
    variances = [
        max(form.sigma, form_error, expected) ** 2
        for form, expected in zip(seat, [max(likely), *likely[1:]], strict=True)
    ]
    by_oval = max(oval.sigma, oval.expected_sigma) * bundle.unknowns.oval
    return _by_forms(bundle, variances) + by_oval @ by_oval.T


def drift_variance(bundle: Bundle) -> float:
    """Return the budgeted variance of the drift over the whole swing, mm^2."""
    return max(
        _prior_variance(bundle, bundle.layout.drift),
        bundle.budget_components.drift.expected_sigma**2,
    )


def _of_seat(bundle: Bundle, form_error: float) -> tuple[FloatArray, FloatArray]:
    """Return covariances (6, 6) by seat modes: beyond the form error, and by it."""
    at = bundle.layout.whole_seat
    gain = bundle.covariance[:6, at] @ bundle.prior_information[at, at]
    known = _by_forms(bundle, [form_error**2] * len(MODE_COUNTS))
    moved = gain @ (seat_covariance(bundle) - known) @ gain.T
    return moved, gain @ known @ gain.T


def _by_forms(bundle: Bundle, variances: Sequence[float]) -> FloatArray:
    """Return the covariance (21, 21) of seat modes by the variance of each kind."""
    alike = np.eye(N_CONE)
    # Where it is significant, its size is estimated from the images.
    is_seen = bundle.budget_components.seat[0].sigma > 0
    axes = alike if is_seen else one_wave_variance(bundle.state.rotations)
    by_form = np.repeat(variances, MODE_COUNTS)
    each = np.arange(len(by_form))
    goes_once = (each < MODE_COUNTS[0])[:, None, None]
    whole = np.zeros((len(by_form), N_CONE, len(by_form), N_CONE))
    whole[each, :, each] = by_form[:, None, None] * np.where(goes_once, axes, alike)
    return whole.reshape(N_CONE * len(by_form), -1)


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
    off = -bundle.covariance[:6, at] @ bundle.prior_information[at, at] @ shape
    # A move of the whole pen is no error of its LEDs but moves the tip.
    off[:3] += np.cross(turn, pen.leds.mean(axis=0) - tip) - shift
    return np.asarray(off)


def one_wave_variance(rotations: FloatArray) -> FloatArray:
    """Return the budgeted covariance of a seat mode of one wave, (3, 3), rig frame.

    In units of the variance of the other modes; rotations (N, 3, 3) are rig_from_pen.
    """
    along = axes_of_cone(rotations)[2]
    return np.eye(3) - (1 - ALONG**2) * np.outer(along, along)


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


def _block_scatter(
    joint: JointFit, bundle: Bundle
) -> tuple[FloatArray | None, float, bool]:
    """Return covariance from blocks (6, 6), equation (20), ratio, and significance.

    Seat modes, drift and jitter are contributions of their own and taken out.
    """
    n_images = len(joint.information)
    n_blocks = min(MAX_BLOCKS, n_images // MIN_BLOCK_SIZE)
    if n_blocks < 3:
        return None, 1.0, False
    noise = joint.covariance
    by_cone = joint.information[..., N_CONE:]
    moved = np.einsum("nik,nk->ni", by_cone, bundle.cone_moves[:n_images])
    gradients = joint.gradients - moved
    scores = np.array(
        [part.sum(axis=0) for part in np.array_split(gradients, n_blocks)]
    )
    scores -= scores.mean(axis=0)
    scatter = scores.T @ scores * n_blocks / (n_blocks - 1)
    blocks = noise @ scatter @ noise
    ratio = float(np.trace(noise @ scatter)) / 6
    jitter = bundle.components.jitter.covariance
    if jitter is not None:
        shaken = np.einsum("nik,kl,njl->ij", by_cone, jitter, by_cone, optimize=True)
        ratio /= 1 + float(np.trace(noise @ shaken)) / 6
    n_free = 6 * (n_blocks - 1)
    return blocks, ratio, ratio > chi_square_quantile(n_free, BY_CHANCE) / n_free
