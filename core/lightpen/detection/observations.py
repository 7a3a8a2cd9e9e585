"""From images to observations: the LED centres of every image, and what was dropped."""

import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.detection.labelling.diagnosis import diagnose, diagnose_mirror
from lightpen.detection.labelling.labels import Labels, LabelStatus, label_images
from lightpen.detection.pose import MIN_LEDS, start_poses
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import Flaw, Spots, detect_spots, shows_smears
from lightpen.errors import CalibrationError, FileError
from lightpen.formats.images import ImageSource, keep_freed_memory
from lightpen.formats.observation_files import Centers
from lightpen.model.camera import Camera
from lightpen.model.ellipse import centers_from_centroids
from lightpen.model.pen import Pen

LABELLED_AT_ONCE = 64  # images; labelling is vectorised over them
IN_FLIGHT = 4  # images per thread that may wait in memory

NO_SPOTS = Spots(
    centers=np.zeros((0, 2)),
    shapes=np.zeros((0, 2, 2)),
    areas=np.zeros(0),
    contrasts=np.zeros(0),
    edge_widths=np.zeros(0),
    flaws=np.zeros(0, dtype=np.int64),
)

Report = Callable[[float], None]


UNSEEN = (Reason.UNREADABLE, Reason.WRONG_SIZE)


@dataclass(frozen=True, eq=False)
class Observations:
    """What N images show of the pen.

    Attributes
    ----------
    names : tuple of str
        File or frame, one an image.
    pixels : (N, L, 2) array
        Ellipse centres of the LEDs that are fit for use, px; NaN elsewhere.
    seen_pixels : (N, L, 2) array
        Centres of all labelled LEDs, also of merged and cut ones, px; NaN elsewhere.
    rotations, translations : (N, 3, 3) and (N, 3) array
        Rough cam_from_pen, mm; NaN where there is none.
    edge_widths : (N,) array
        Mean width of the rims of the labelled LEDs from dark to bright, px; NaN where
        none is labelled, or only centres are given.
    reasons : tuple of Reason
        Why an image cannot be used; `Reason.NONE` where it can.
    details : tuple of str
        A sentence on that, empty where the reason says all.
    advice : str
        What may be wrong with the set as a whole; empty when most images are labelled.
    """

    names: tuple[str, ...]
    pixels: FloatArray
    seen_pixels: FloatArray
    rotations: FloatArray
    translations: FloatArray
    edge_widths: FloatArray
    reasons: tuple[Reason, ...]
    details: tuple[str, ...]
    advice: str = ""


@dataclass(frozen=True, eq=False)
class _Sighting:
    """The spots of one image, or why it cannot have any."""

    spots: Spots
    reason: Reason
    detail: str


def observe_images(
    source: ImageSource,
    camera: Camera,
    pen: Pen,
    report: Report = lambda fraction: None,
    n_threads: int | None = None,
    mask: FloatArray | None = None,
) -> Observations:
    """Find and label the LEDs in images.

    Images are decoded and searched in threads and leave memory at once; labelling
    follows in batches while further images are decoded.

    Parameters
    ----------
    source : ImageSource
    camera : Camera
    pen : Pen
    report : callable
        Called with the fraction done, 0 to 1.
    n_threads : int, optional
        One a core if not given.
    mask : (M, 3) array, optional
        Circles of stray light to leave out: centre x, y and radius, px.

    Returns
    -------
    Observations

    Raises
    ------
    FileError
        No image can be read, or most are of another size than the camera file.
    CalibrationError
        The images are of the mirror image of the pen.
    """
    keep_freed_memory()
    sightings: list[_Sighting] = []
    labels: list[Labels] = []
    n_images = len(source.names)
    detect = partial(_detect, camera=camera, mask=mask)
    for sighting in _in_threads(source, detect, n_threads or os.cpu_count() or 1):
        sightings.append(sighting)
        if len(sightings) - len(labels) == LABELLED_AT_ONCE:
            labels += _label(sightings[len(labels) :], camera, pen)
        report(len(sightings) / n_images)
    labels += _label(sightings[len(labels) :], camera, pen)
    _require_size(sightings, camera)
    return _assemble(source.names, sightings, labels, camera, pen)


def observe_centers(centers: Centers, camera: Camera, pen: Pen) -> Observations:
    """Take LED centres that were found and labelled elsewhere.

    Parameters
    ----------
    centers : Centers
    camera : Camera
    pen : Pen

    Returns
    -------
    Observations

    Raises
    ------
    FileError
        Most centres are outside the image of the camera file.
    """
    pixels = centers.pixels
    _require_inside(pixels, camera)
    n_seen = np.isfinite(pixels[..., 0]).sum(axis=1)
    enough = n_seen >= MIN_LEDS
    rotations = np.full((len(pixels), 3, 3), np.nan)
    translations = np.full((len(pixels), 3), np.nan)
    rotations[enough], translations[enough] = start_poses(camera, pen, pixels[enough])
    reasons = np.full(len(pixels), Reason.NONE, dtype=object)
    reasons[np.isnan(translations[:, 0])] = Reason.MISFIT
    reasons[~enough] = Reason.TOO_FEW_LEDS
    return Observations(
        names=tuple(f"frame {frame}" for frame in centers.frames),
        pixels=pixels,
        seen_pixels=pixels,
        rotations=rotations,
        translations=translations,
        edge_widths=np.full(len(pixels), np.nan),
        reasons=tuple(reasons.tolist()),
        details=("",) * len(pixels),
    )


def leave_out(
    observations: Observations, reasons: Mapping[int, Reason]
) -> Observations:
    """Return the observations with other images left out, by index, and why.

    An image that was of no use anyway keeps the reason that it has.
    """
    kept = list(observations.reasons)
    for index, reason in reasons.items():
        if kept[index] is Reason.NONE:
            kept[index] = reason
    return replace(observations, reasons=tuple(kept))


def _in_threads(
    source: ImageSource,
    detect: Callable[[Callable[[], Image]], _Sighting],
    n_threads: int,
) -> Iterator[_Sighting]:
    """Detect the spots of all images, in order, with a bounded number in memory."""
    with ThreadPoolExecutor(n_threads) as executor:
        waiting: deque[Future[_Sighting]] = deque()
        for load in source.open():
            waiting.append(executor.submit(detect, load))
            if len(waiting) >= IN_FLIGHT * n_threads:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def _detect(
    load: Callable[[], Image], camera: Camera, mask: FloatArray | None
) -> _Sighting:
    try:
        image = load()
    except FileError as error:
        return _Sighting(NO_SPOTS, Reason.UNREADABLE, str(error))
    if not camera.fits(image):
        height, width = image.shape
        return _Sighting(NO_SPOTS, Reason.WRONG_SIZE, f"{width} x {height} px")
    spots = detect_spots(image, mask)
    if len(spots) == 0:
        return _Sighting(
            spots, Reason.BLURRED if shows_smears(image) else Reason.EMPTY, ""
        )
    return _Sighting(spots, Reason.NONE, "")


def _label(sightings: list[_Sighting], camera: Camera, pen: Pen) -> list[Labels]:
    return label_images([s.spots for s in sightings], camera, pen)


def _require_size(sightings: list[_Sighting], camera: Camera) -> None:
    if all(s.reason is Reason.UNREADABLE for s in sightings):
        raise FileError(
            f"None of the {len(sightings)} images can be read. {sightings[0].detail}"
        )
    wrong = [s.detail for s in sightings if s.reason is Reason.WRONG_SIZE]
    n_readable = sum(s.reason is not Reason.UNREADABLE for s in sightings)
    if 2 * len(wrong) > n_readable:
        raise FileError(
            f"{len(wrong)} of {n_readable} images are {wrong[0]}, the camera file was "
            f"made for {camera.width} x {camera.height} px. Choose the file for this "
            "camera, or switch off binning and cropping."
        )


def _require_inside(pixels: FloatArray, camera: Camera) -> None:
    points = pixels[np.isfinite(pixels[..., 0])]
    far = points.max(axis=0, initial=0)
    outside = np.any((points < -0.5) | (points > camera.image_size), axis=1)
    if 2 * outside.sum() > len(points):
        raise FileError(
            f"The LED centres reach to ({far[0]:.0f}, {far[1]:.0f}) px, the camera "
            f"file was made for {camera.width} x {camera.height} px. Choose the file "
            "for this camera."
        )


def _assemble(
    names: tuple[str, ...],
    sightings: list[_Sighting],
    labels: list[Labels],
    camera: Camera,
    pen: Pen,
) -> Observations:
    n_images = len(names)
    seen = np.full((n_images, pen.n_leds, 2), np.nan)
    shapes = np.full((n_images, pen.n_leds, 2, 2), np.nan)
    whole = np.zeros((n_images, pen.n_leds), dtype=bool)
    edge_widths = np.full(n_images, np.nan)
    for i, (sighting, label) in enumerate(zip(sightings, labels, strict=True)):
        labelled = label.spot >= 0
        if labelled.any():
            seen[i, labelled] = sighting.spots.centers[label.spot[labelled]]
            shapes[i, labelled] = sighting.spots.shapes[label.spot[labelled]]
            whole[i] = label.whole & labelled
            edge_widths[i] = sighting.spots.edge_widths[label.spot[labelled]].mean()
    seen = centers_from_centroids(camera, seen, shapes)
    reasons = tuple(map(_reason, sightings, labels))
    spots = [s.spots for s in sightings if s.reason not in UNSEEN]
    mostly_labelled = 2 * reasons.count(Reason.NONE) > n_images
    if mostly_labelled and not np.isfinite(seen[..., 0]).any(axis=0).all():
        _require_right_hand(spots, camera, pen)
    return Observations(
        names=names,
        pixels=np.where(whole[..., None], seen, np.nan),
        seen_pixels=seen,
        rotations=np.array([label.R for label in labels]).reshape(-1, 3, 3),
        translations=np.array([label.t for label in labels]).reshape(-1, 3),
        edge_widths=edge_widths,
        reasons=reasons,
        details=tuple(s.detail for s in sightings),
        advice="" if mostly_labelled else _advice(reasons, spots, camera, pen),
    )


def _advice(
    reasons: tuple[Reason, ...], spots: list[Spots], camera: Camera, pen: Pen
) -> str:
    if 2 * reasons.count(Reason.AMBIGUOUS) > len(reasons):
        return (
            "The LEDs of this pen look the same when it is turned or mirrored, so they "
            "cannot be told apart. Move an LED, or give the LED centres with --centers."
        )
    return diagnose(spots, camera, pen)


def _require_right_hand(spots: list[Spots], camera: Camera, pen: Pen) -> None:
    """Refuse a mirrored pen, of which only the asymmetric LEDs are not found."""
    sentence = diagnose_mirror(spots, camera, pen)
    if sentence:
        raise CalibrationError(sentence)


def _reason(sighting: _Sighting, label: Labels) -> Reason:
    if sighting.reason is not Reason.NONE:
        return sighting.reason
    if label.reason is LabelStatus.LABELLED:
        return Reason.NONE
    if label.reason is LabelStatus.AMBIGUOUS:
        return Reason.AMBIGUOUS
    if np.mean((sighting.spots.flaws & Flaw.BLURRED) > 0) > 0.5:
        return Reason.BLURRED
    if label.reason is LabelStatus.TOO_FEW:
        return Reason.TOO_FEW_LEDS
    return Reason.NOT_THE_PEN
