"""Checks: too few LEDs, a second pen, wrong lengths, weak swings."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.consistency_findings import DIAMETER
from lightpen.estimation.bundle.priors import ConeSeparation
from lightpen.estimation.calibrate import Calibration
from lightpen.formats.camera_checks import LARGEST_FOLD
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.posture import tilts_of
from lightpen_extensions.discover.found import Discovery
from lightpen_extensions.discover.labelling import Labelled
from lightpen_extensions.discover.request import Request
from lightpen_extensions.discover.scale import CONTRADICTING, nearest_pair
from lightpen_extensions.discover.sightings import Sightings
from lightpen_extensions.discover.starts import KnownLength, gradient_of

MIN_IMAGES = 40
MIN_LEDS = 5
SECOND_PEN = 3  # lights that move together, besides the LEDs of the pen
OTHER_SIZE = 0.1  # relative: discs that are another size than stated
ZOOMED = 1e-3  # of the focal length, between both halves of a swing, and
HALVES_APART = 6.0  # standard deviations of the difference
HALVES_MISFIT = 3.0  # times the noise of either half alone
MOST_USED = 0.7  # of the images that show LEDs enough
ROUGHLY = 2.5  # mm, standard deviation of a sketch accurate to 5 mm
OTHERWISE_WARM = 2e-4  # relative, of a length: 10 K of aluminium
WORST_TIP, WORST_FOCAL = 0.02, 0.03  # U over the pen's size, and relative


class Halves(NamedTuple):
    """The two halves of a swing, each adjusted alone."""

    focal_lengths: FloatArray  # (2,), px
    sigmas: FloatArray  # (2,), their standard uncertainties, px
    misfit: float  # noise about the common start, over the noisier half's own


def require_enough(sightings: Sightings) -> None:
    """Refuse too few images or LEDs."""
    counts = np.array([len(each) for each in sightings.centers])
    if len(counts) < MIN_IMAGES:
        raise CalibrationError(
            "discover.too-few-images", n_images=len(counts), needed=MIN_IMAGES
        )
    n_leds = int(np.quantile(counts, 0.75))
    if n_leds < MIN_LEDS:
        raise CalibrationError("discover.too-few-leds", n_leds=n_leds, needed=MIN_LEDS)


def require_no_second_pen(found: Labelled) -> None:
    """Refuse images with moving spots beside a pen that is seen whole."""
    n_leds = (found.spots >= 0).sum(axis=1)
    is_whole = n_leds >= np.quantile(n_leds, 0.75)
    n_others = int(np.median(found.unexplained[is_whole].sum(axis=1)))
    if n_others >= SECOND_PEN:
        raise CalibrationError("discover.two-pens", n_others=n_others)


def require_length(
    calibration: Calibration, request: Request, lengths: Sequence[KnownLength]
) -> None:
    """Refuse a length that contradicts the diameter of the discs."""
    if not request.lengths:
        return
    for each in calibration.contradictions:
        if each.what != DIAMETER or each.estimated <= 0:
            continue
        ratio = each.stated / each.estimated
        if abs(ratio - 1) < OTHER_SIZE:
            continue
        if request.touched is not None:
            raise CalibrationError(
                "discover.touched-length",
                length=request.touched.separation.distance,
                found=each.estimated,
                stated=each.stated,
            )
        leds, length = ratio * calibration.bundle.state.pen.leds, lengths[0].length
        first, second, _ = nearest_pair(leds, length)
        raise CalibrationError(
            "discover.length-of-others",
            length=length,
            first=lengths[0].first + 1,
            second=lengths[0].second + 1,
            found=each.estimated,
            stated=each.stated,
            other=first,
            another=second,
        )


def require_distance(
    without: Calibration, stated: ConeSeparation, lengths: Sequence[KnownLength]
) -> None:
    """Refuse a distance of two cones that known lengths contradict.

    ``without`` is the calibration by both swings without the distance, scaled by the
    lengths alone.
    """
    bundle, second = without.bundle, without.second
    assert second is not None
    along = bundle.state.between_rig / second.distance
    at = bundle.unknowns.layout.between
    sigma = np.sqrt(along @ bundle.covariance[at, at] @ along)
    off = abs(second.distance - stated.distance)
    if off > CONTRADICTING * np.hypot(sigma, stated.sigma):
        raise contradicting_distance(stated.distance, second.distance, lengths[0])


def contradicting_distance(
    stated: float, implied: float, known: KnownLength
) -> CalibrationError:
    """Return the error of a cone distance, mm, that a known length contradicts."""
    return CalibrationError(
        "discover.cones-contradict",
        distance=stated,
        implied=implied,
        length=known.length,
        first=known.first + 1,
        second=known.second + 1,
    )


def require_lens(camera: Camera) -> None:
    """Refuse a lens that no camera file can state, as the corners were not seen."""
    if camera.folded_share > LARGEST_FOLD:
        raise CalibrationError("discover.lens-folds")


def require_one_camera(halves: Halves) -> None:
    """Refuse a swing whose halves fit alone, but not together."""
    first, second = halves.focal_lengths.tolist()
    by_chance = HALVES_APART * float(np.linalg.norm(halves.sigmas))
    if abs(first - second) > max(ZOOMED * first, by_chance):
        raise CalibrationError("discover.camera-changed", first=first, second=second)
    if halves.misfit > HALVES_MISFIT:
        raise CalibrationError("discover.halves-apart", times=halves.misfit)


def require_sketched(lengths: Sequence[KnownLength], sketch: Pen) -> None:
    """Refuse lengths that the sketch of the pen contradicts."""
    for each in lengths:
        row = gradient_of(sketch.leds, each)
        sketched = each.between(sketch.leds)
        if sketch.led_covariance is not None:
            variance = float(row @ sketch.led_covariance @ row)
        elif sketch.led_sigma is not None:
            variance = 2 * sketch.led_sigma**2
        else:
            variance = 2 * ROUGHLY**2
        sigma = np.sqrt(variance + each.sigma**2 + (OTHERWISE_WARM * sketched) ** 2)
        sigma = np.hypot(sigma, (sketch.scale_sigma or 0.0) * sketched)
        if abs(each.length - sketched) > CONTRADICTING * sigma:
            raise CalibrationError(
                "discover.length-not-sketched",
                length=each.length,
                first=each.first + 1,
                second=each.second + 1,
                sketched=sketched,
            )


def require_certain(discovery: Discovery, sightings: Sightings) -> None:
    """Refuse a swing with weak tip or camera, or with many excluded images."""
    calibration = discovery.calibration
    n_used = int(calibration.used.sum())
    n_images = sum(len(each) >= MIN_LEDS for each in sightings.centers)
    if n_used < MOST_USED * n_images:
        raise CalibrationError(
            "discover.many-left-out", n_used=n_used, n_images=n_images
        )
    size = float(np.ptp(discovery.pen.leds, axis=0).max())
    U = float(discovery.expanded_uncertainty.max())
    focal = float(discovery.intrinsics_sigma[0]) / discovery.camera.fx
    if U / size > WORST_TIP or focal > WORST_FOCAL:
        tilts = np.degrees(tilts_of(calibration.joint.rotations))
        raise CalibrationError(
            "discover.weak-swing", U=U, focal=100 * focal, tilt=float(np.ptp(tilts))
        )
