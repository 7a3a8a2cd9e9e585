"""What is refused: too little to see, a second pen, wrong lengths, weak swings."""

from collections.abc import Sequence

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.discovery.found import Discovery
from lightpen.discovery.labelling import Labelled
from lightpen.discovery.request import Request
from lightpen.discovery.scale import nearest_pair
from lightpen.discovery.sightings import Sightings
from lightpen.discovery.starts import KnownLength
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.consistency_findings import DIAMETER
from lightpen.estimation.calibrate import Calibration
from lightpen.intrinsics.distortion import folds
from lightpen.model.camera import Camera
from lightpen.model.posture import tilts_of

MIN_IMAGES = 40
MIN_LEDS = 5
SECOND_PEN = 3  # lights that move with one another, beside those of the pen
OTHER_SIZE = 0.1  # relative: discs that are another size than stated
ZOOMED = 1e-3  # of the focal length, between both halves of a swing, and
HALVES_APART = 6.0  # standard deviations of the difference
MOST_USED = 0.5  # of the images
WORST_TIP, WORST_FOCAL = 0.02, 0.03  # U over the pen's size, and relative


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
    """Refuse images in which more moves than one pen."""
    n_others = int(np.median(found.unexplained.sum(axis=1)))
    if n_others >= SECOND_PEN:
        raise CalibrationError("discover.two-pens", n_others=n_others)


def require_length(
    calibration: Calibration, request: Request, lengths: Sequence[KnownLength]
) -> None:
    """Refuse a length that contradicts the stated diameter of the discs."""
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


def require_lens(camera: Camera) -> None:
    """Refuse a lens that no camera file can state, as the corners were not seen."""
    if folds(camera):
        raise CalibrationError("discover.lens-folds")


def require_one_focal_length(halves: FloatArray, sigmas: FloatArray) -> None:
    """Refuse a swing whose halves have focal lengths, (2,), px, of their own."""
    first, second = halves.tolist()
    by_chance = HALVES_APART * float(np.linalg.norm(sigmas))
    if abs(first - second) > max(ZOOMED * first, by_chance):
        raise CalibrationError("discover.camera-changed", first=first, second=second)


def require_certain(discovery: Discovery) -> None:
    """Refuse a swing that hardly determines tip or camera, or much of which is left.

    Raises
    ------
    CalibrationError
        Says what is missing.
    """
    calibration = discovery.calibration
    n_used, n_images = int(calibration.used.sum()), len(calibration.used)
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
