"""What the tip is worth: covariance, repeatability between blocks, halves, weakness.

The bundle adjustment states the covariance that noise and every prior leave, as the GUM
[2]_ combines independent components. Real residuals hang together from image to image:
their autocorrelation (`lightpen.estimation.noise_correlation`) and the scatter between
blocks of consecutive images (cluster-robust, [1]_) tell by how much that raises the
share of noise; the larger one counts, where it is significant.

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
from lightpen.estimation.adjustment import Adjustment
from lightpen.estimation.bundle import Z_99, Bundle
from lightpen.estimation.joint import JointFit
from lightpen.estimation.linearised import N_CONE
from lightpen.estimation.priors import Priors
from lightpen.estimation.seat_forms import FORMS, axes_of_cone
from lightpen.estimation.unknowns import whole_moves

COVERAGE_FACTOR = 2.0  # k of the expanded uncertainty
MAX_BLOCKS = 10
MIN_BLOCK_SIZE = 3
POSTURES = 30  # that differ enough for centres to be off in another way
# Of a seat that goes once round with the pen, hardly seen beside the tip: times what
# the other forms have, along the cone. A ball or cone that is not round moves the tip
# sideways, and little up and down. `./run bench files` holds both.
ALONG = 0.4
NEGLIGIBLE = 1e-5  # mm, of a standard uncertainty


class ShareName(StrEnum):
    """What makes a tip uncertain."""

    NOISE = "noise"
    CENTERS = "led centres"  # what does not average out
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
    HELD_BACK = "not followed"  # what may be so, but is not certain enough


IMAGES_SHRINK = (
    ShareName.NOISE,
    ShareName.CENTERS,
    ShareName.SEAT,
    ShareName.DRIFT,
    ShareName.HELD_BACK,
)


@dataclass(frozen=True, eq=False)
class Share:
    """One part of the uncertainty.

    Attributes
    ----------
    covariance : (6, 6) array
        Of (tip_pen, cone_cam), mm^2.
    assumed : bool
        Whether it rests on an assumption, as a file does not state it.
    """

    name: ShareName
    covariance: FloatArray
    assumed: bool = False

    @property
    def standard_uncertainty(self) -> FloatArray:
        """Of the three coordinates of the tip, (3,), mm."""
        return np.sqrt(np.maximum(np.diag(self.covariance)[:3], 0.0))


@dataclass(frozen=True, eq=False)
class Budget:
    """Covariance of (tip_pen, cone_cam) and what it is made of.

    Attributes
    ----------
    shares : tuple of Share
        They add up to the covariance; what has no part in it is left out.
    independent_noise : (6, 6) array
        From image noise as if it were independent between images, mm^2.
    blocks : (6, 6) array or None
        From the scatter between blocks of consecutive images, all but tip and cone
        held, mm^2; None with too few images.
    block_ratio : float
        Variance between blocks over that of independent noise, and of a jitter of the
        seat where there is one; 1 on average.
    autocorrelation : float
        Of the errors of one coordinate from one image to the next; 0 where not
        significant.
    correlation_factor : float
        How many times the share of noise is larger than that of independent noise.
    """

    shares: tuple[Share, ...]
    independent_noise: FloatArray
    blocks: FloatArray | None
    block_ratio: float
    autocorrelation: float
    correlation_factor: float

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
        """Unit vector of the pen frame along which the tip is known least."""
        _, vectors = np.linalg.eigh(self.covariance[:3, :3])
        weakest = vectors[:, -1]
        return np.asarray(weakest * np.sign(weakest[np.argmax(np.abs(weakest))]))

    @property
    def weakest_uncertainty(self) -> float:
        """U (k = 2) along the weakest direction, mm."""
        values = np.linalg.eigvalsh(self.covariance[:3, :3])
        return COVERAGE_FACTOR * float(np.sqrt(values[-1]))

    @property
    def largest_share(self) -> Share:
        """The share that counts most along the weakest direction."""
        return max(self.shares, key=self.weakest_share)

    def weakest_share(self, share: Share) -> float:
        """Return U (k = 2) of one share along the weakest direction, mm."""
        along = self.weakest_direction
        variance = float(along @ share.covariance[:3, :3] @ along)
        return COVERAGE_FACTOR * float(np.sqrt(max(variance, 0.0)))


@dataclass(frozen=True, eq=False)
class Halves:
    """Tip from the odd images against tip from the even ones.

    Attributes
    ----------
    difference : (3,) array
        Odd minus even, pen frame, mm.
    expanded_uncertainty : (3,) array
        U (k = 2) of the difference from image noise, mm.
    """

    difference: FloatArray
    expanded_uncertainty: FloatArray


def combine(adjustment: Adjustment, joint: JointFit) -> Budget:
    """Combine the parts of the tip's uncertainty; ``joint`` at the estimate."""
    bundle, correlation = adjustment.allowed, adjustment.correlation
    blocks, ratio, blocks_count = _block_scatter(joint, adjustment.bundle)
    raised = max(ratio / correlation.factor, 1.0) if blocks_count else 1.0
    n_images = int(bundle.used.any(axis=(1, 2)).sum())
    return Budget(
        shares=shares_of(
            bundle,
            adjustment.priors,
            n_images,
            noise=raised * correlation.noise,
            held_back=adjustment.held_back,
        ),
        independent_noise=bundle.independent_noise,
        blocks=blocks,
        block_ratio=ratio,
        autocorrelation=correlation.coefficient,
        correlation_factor=raised * correlation.factor,
    )


def shares_of(
    bundle: Bundle,
    priors: Priors,
    n_images: float,
    noise: FloatArray,
    held_back: FloatArray,
) -> tuple[Share, ...]:
    """Return what makes a tip uncertain, of a swing as it grows or as a whole.

    Parameters
    ----------
    bundle : Bundle
        With all that is assumed allowed.
    priors : Priors
        Those that it was fitted with.
    n_images : float
        How many take part.
    noise : (6, 6) array
        Of tip and cone by the noise of the images, mm^2.
    held_back : (6,) array
        What holding back from what is allowed changed, mm.
    """
    at = bundle.columns
    jitter = bundle.carried(bundle.jitter_information + bundle.doubted_jitter)
    moved, by_form = _of_seat(bundle, priors.form_error)
    drift = bundle.counted_part(at.drift)
    drift *= counted_drift(bundle) / _counted(bundle, at.drift)
    # Centres that are off in each posture its own way.
    biased = max(n_images / POSTURES, 1.0) * bundle.independent_noise
    biased *= (priors.center_bias / bundle.sigma) ** 2
    if priors.reading is not None:
        along_normals = priors.reading.shift * _by_shift_along_normals(bundle)
        biased += np.outer(along_normals, along_normals)
    size = bundle.part(at.scale)
    warm = float(priors.temperature.covariance[0, 0] / priors.size_covariance[0, 0])
    shares = [
        Share(ShareName.NOISE, noise),
        Share(ShareName.CENTERS, biased, assumed=True),
        Share(ShareName.SEAT, jitter + moved),
        Share(ShareName.FORM, by_form, assumed=True),
        Share(ShareName.DRIFT, drift),
        Share(ShareName.LEDS, bundle.counted_part(at.leds)),
        Share(ShareName.SCALE, (1 - warm) * size, priors.scale.assumed),
        Share(ShareName.TEMPERATURE, warm * size, priors.temperature.assumed),
        Share(ShareName.DISTANCE, bundle.part(at.between)),
        Share(ShareName.DIAMETER, bundle.part(at.diameter), priors.diameter.assumed),
        Share(
            ShareName.CAMERA,
            bundle.part(*at.cameras),
            any(camera.assumed for camera in priors.cameras),
        ),
    ]
    if priors.extrinsics is not None:
        rig = bundle.part(at.extrinsics)
        shares.append(Share(ShareName.EXTRINSICS, rig, priors.extrinsics.assumed))
    shares.append(Share(ShareName.HELD_BACK, np.outer(held_back, held_back)))
    return tuple(
        share for share in shares if share.standard_uncertainty.max() > NEGLIGIBLE
    )


def counted_seat(bundle: Bundle) -> FloatArray:
    """Return the covariance of the seat's moves in its forms that U holds, (21, 21)."""
    seat, oval = bundle.counted.seat, bundle.counted.oval
    likely = [form.expected for form in seat]
    form_error = bundle.unknowns.priors.form_error
    variances = [
        max(form.sigma, form_error, expected) ** 2
        for form, expected in zip(seat, [max(likely), *likely[1:]], strict=True)
    ]
    by_oval = max(oval.sigma, oval.expected) * bundle.unknowns.oval
    return _by_forms(bundle, variances) + by_oval @ by_oval.T


def counted_drift(bundle: Bundle) -> float:
    """Return the variance of a drift over the whole of each way that U holds, mm^2."""
    return max(_counted(bundle, bundle.columns.drift), bundle.counted.drift.expected**2)


def _of_seat(bundle: Bundle, form_error: float) -> tuple[FloatArray, FloatArray]:
    """Return what the lean of the pen does, beyond the form error and by it."""
    at = bundle.columns.whole_seat
    gain = bundle.covariance[:6, at] @ bundle.prior_information[at, at]
    known = _by_forms(bundle, [form_error**2] * len(FORMS))
    moved = gain @ (counted_seat(bundle) - known) @ gain.T
    return moved, gain @ known @ gain.T


def _by_forms(bundle: Bundle, variances: Sequence[float]) -> FloatArray:
    """Return the covariance of the seat's moves by the variance of each kind."""
    alike = np.eye(N_CONE)
    # Where images are many enough to see it, they tell themselves how large it is.
    is_seen = bundle.counted.seat[0].sigma > 0
    axes = alike if is_seen else once_round(bundle.state.rotations)
    by_form = np.repeat(variances, FORMS)
    each = np.arange(len(by_form))
    goes_once = (each < FORMS[0])[:, None, None]
    whole = np.zeros((len(by_form), N_CONE, len(by_form), N_CONE))
    whole[each, :, each] = by_form[:, None, None] * np.where(goes_once, axes, alike)
    return whole.reshape(N_CONE * len(by_form), -1)


def _by_shift_along_normals(bundle: Bundle) -> FloatArray:
    """Return what tip and cone are off by where all LEDs stand 1 mm along, (6,)."""
    pen, tip = bundle.unknowns.start.pen, bundle.state.tip_pen
    moves = pen.normals.ravel()
    shift, turn = np.linalg.lstsq(whole_moves(pen.leds), moves, rcond=None)[0].reshape(
        2, 3
    )
    at, shape = bundle.columns.leds, bundle.unknowns.basis.T @ moves
    off = -bundle.covariance[:6, at] @ bundle.prior_information[at, at] @ shape
    # A move of the pen as a whole is no error of its LEDs: the tip is off by it.
    off[:3] += np.cross(turn, pen.leds.mean(axis=0) - tip) - shift
    return np.asarray(off)


def once_round(rotations: FloatArray) -> FloatArray:
    """Return how a seat that goes once round with the pen is counted, (3, 3).

    Times the variance that the other forms have, by direction in the rig; rotations
    (N, 3, 3) are of rig_from_pen.
    """
    along = axes_of_cone(rotations)[2]
    return np.eye(3) - (1 - ALONG**2) * np.outer(along, along)


def _counted(bundle: Bundle, at: slice) -> float:
    return 1 / float(bundle.counted_prior[at.start, at.start])


def compare_halves(joint: JointFit) -> Halves:
    """Compare the tip of the odd images with that of the even ones."""
    steps, covariances = [], []
    for first in (0, 1):
        S = joint.information[first::2].sum(axis=0)
        steps.append(np.linalg.solve(S, joint.gradients[first::2].sum(axis=0)))
        covariances.append(np.linalg.inv(S))
    variances = np.diag(covariances[0] + covariances[1])[:3]
    return Halves(
        difference=(steps[0] - steps[1])[:3],
        expanded_uncertainty=COVERAGE_FACTOR * np.sqrt(variances),
    )


def _block_scatter(
    joint: JointFit, bundle: Bundle
) -> tuple[FloatArray | None, float, bool]:
    """Return the covariance from blocks, its ratio to the noise's, and significance.

    What the cone moved by as the pen leant and in time is a share of its own and taken
    out, and so is a jitter of the seat: the scatter is expected to hold it.
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
    return blocks, ratio, ratio > _chi_square_quantile_99(n_free) / n_free


def _chi_square_quantile_99(n_free: int) -> float:
    """Return the 99 % quantile of chi-square (Wilson and Hilferty, 1931)."""
    spread = 2 / (9 * n_free)
    return float(n_free * (1 - spread + Z_99 * np.sqrt(spread)) ** 3)
