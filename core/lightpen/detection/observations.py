"""From images to observations: LED centres, and reasons for unused images."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Self

import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.detection.fixed_lamps import fixed_lamps, masked_lights
from lightpen.detection.labelling.causes import diagnose, diagnose_mirror
from lightpen.detection.labelling.labels import label_images
from lightpen.detection.pen_detection import (
    PenDetection,
    detection_of_centers,
    detections_of,
    unseen,
)
from lightpen.detection.pose import MIN_POSE_LEDS, start_poses
from lightpen.detection.reasons import UNFORESEEN, Reason, exception_detail
from lightpen.detection.small_spots import MIN_WIDTH
from lightpen.detection.spots import Spots, detect_spots
from lightpen.errors import CalibrationError, FileError
from lightpen.formats.decoding import full_scale_of
from lightpen.formats.images import ImageSource, look_at_all
from lightpen.formats.observation_files import Centers
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

LABELLED_AT_ONCE = 64  # images; labelling is vectorised over them
SAME = 0.002  # px, rms: between the noise of two images and of recoding one
SEARCH_MEMORY_A_PIXEL = 5  # bytes: 16 bits, twice, and the saturated ones

Report = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Observations:
    """Detections of the pen in N images."""

    names: tuple[str, ...]  # file or frame, one an image
    # (N, L, 2), ellipse centres of the LEDs that are fit for use, px; NaN elsewhere.
    pixels: FloatArray
    # (N, L, 2), centres of all labelled LEDs, also merged and cut ones, px; else NaN.
    seen_pixels: FloatArray
    # (N, L), areas of the LEDs that are fit for use, not saturated and larger than
    # their blur, px^2; NaN elsewhere, or where only centres are given.
    areas: FloatArray
    # (N, L), standard deviation of one coordinate of each centre by its estimator, px,
    # which shows how LEDs of one image compare; NaN where an LED is not fit for use.
    sigmas: FloatArray
    # `rotations`, `translations`: (N, 3, 3) and (N, 3), rough cam_from_pen, mm, or NaN.
    rotations: FloatArray
    translations: FloatArray
    # (N,), mean width of the rims of the labelled LEDs from dark to bright, px; NaN
    # where none is labelled, or only centres are given.
    edge_widths: FloatArray
    # (N, K, 2), centres of K fixed lamps, px; NaN where an image lacks them or the pen.
    lamps: FloatArray
    # Why an image cannot be used; `Reason.NONE` where it can.
    reasons: tuple[Reason, ...]
    details: tuple[Message | None, ...]  # further explanation of the reasons
    # Likely problem of the whole set; None if most images with spots are labelled.
    advice: Message | None = None
    # Time from one image to the next; None if not known.
    interval_ms: float | None = None


@dataclass(frozen=True, eq=False)
class _Searched:
    """The spots of one image, or why there are none, and masked lights, (M, 2)."""

    spots: Spots = field(default_factory=Spots.none)
    masked: FloatArray | None = None
    reason: Reason = Reason.NONE
    detail: Message | None = None

    @classmethod
    def failed(cls, error: Exception) -> Self:
        return cls(reason=Reason.UNHANDLED, detail=exception_detail(error))


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
    report : callable
        Called with the fraction done, 0 to 1.
    n_threads : int, optional
        If not given, one a core, but fewer if the images are large.
    mask : (M, 3) array, optional
        Circles of stray light to leave out: centre x, y and radius, px.

    Raises
    ------
    FileError
        No image can be read, or most are of another size than the camera file.
    CalibrationError
        The images are of the mirror image of the pen.
    """
    searched: list[_Searched] = []
    labelled: list[tuple[_Searched, PenDetection]] = []
    n_images = len(source.names)
    search = partial(
        _search, camera=camera, mask=mask, stated_full_scale=source.full_scale
    )
    for image in look_at_all(source, search, SEARCH_MEMORY_A_PIXEL, n_threads):
        searched.append(image)
        n_done = len(labelled) + len(searched)
        if len(searched) == LABELLED_AT_ONCE or n_done == n_images:
            labelled += _labelled(searched, camera, pen)
            searched = []
        report(n_done / n_images)
    images = [image for image, _ in labelled]
    detections = [detection for _, detection in labelled]
    _require_size(images, camera)
    nothing = np.full((0 if mask is None else len(mask), 2), np.nan)
    masked = np.stack([nothing if i.masked is None else i.masked for i in images])
    seen = _observations(
        source.names, detections, _lamps_beside_pen(masked, detections)
    )
    spots = [detection.spots for detection in detections if detection.spots is not None]
    n_lit = sum(len(found) > 0 for found in spots)
    mostly_labelled = 2 * seen.reasons.count(Reason.NONE) > n_lit
    if mostly_labelled and not np.isfinite(seen.seen_pixels[..., 0]).any(axis=0).all():
        _require_right_hand(spots, camera, pen)
    seen = replace(seen, details=tuple(image.detail for image in images))
    return replace(
        without_copies(seen),
        advice=None if mostly_labelled else _advice(seen.reasons, spots, camera, pen),
    )


def observe_centers(centers: Centers, camera: Camera, pen: Pen) -> Observations:
    """Take LED centres that were found and labelled elsewhere.

    Raises `FileError` if most are outside the image of the camera file.
    """
    _require_inside(centers.pixels, camera)
    seen = camera.sees(centers.pixels)
    pixels = np.where(seen[..., None], centers.pixels, np.nan)
    enough = np.isfinite(pixels[..., 0]).sum(axis=1) >= MIN_POSE_LEDS
    rotations = np.full((len(pixels), 3, 3), np.nan)
    translations = np.full((len(pixels), 3), np.nan)
    rotations[enough], translations[enough] = start_poses(camera, pen, pixels[enough])
    names = tuple(f"frame {frame}" for frame in centers.frames)
    images = zip(pixels, rotations, translations, strict=True)
    detections = [detection_of_centers(*image) for image in images]
    return without_copies(
        _observations(names, detections, np.zeros((len(names), 0, 2)))
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


def without_copies(seen: Observations) -> Observations:
    """Return observations whose copies of earlier images have the reason ``COPY``.

    Copies have the same LEDs with the same centres, but for rounding and another
    coding; two images of a pen at rest differ by their noise.
    """
    used = np.flatnonzero([reason is Reason.NONE for reason in seen.reasons])
    pixels = seen.pixels[used].reshape(len(used), 2 * seen.pixels.shape[1])
    known = np.isfinite(pixels)
    pixels = np.where(known, pixels, 0.0)
    counts = np.maximum(known.sum(axis=1), 1)
    means = pixels.sum(axis=1) / counts  # means of copies differ by less than SAME
    order, firsts = np.argsort(means, kind="stable"), np.arange(len(used))
    for step in range(1, len(used)):
        near = means[order[step:]] - means[order[:-step]] < SAME
        if not near.any():
            break
        one, other = order[:-step][near], order[step:][near]
        same = np.all(known[one] == known[other], axis=1)
        squares = np.sum((pixels[one] - pixels[other]) ** 2, axis=1)
        same &= squares < SAME**2 * counts[one]
        earlier, later = np.sort([one[same], other[same]], axis=0)
        np.minimum.at(firsts, later, earlier)
    reasons, details = list(seen.reasons), list(seen.details)
    for i, first in enumerate(firsts):
        if first < i:
            reasons[used[i]] = Reason.COPY
            details[used[i]] = message("image.copy-of", name=seen.names[used[first]])
    return replace(seen, reasons=tuple(reasons), details=tuple(details))


def _search(
    load: Callable[[], Image],
    camera: Camera,
    mask: FloatArray | None,
    stated_full_scale: int | None,
) -> _Searched:
    try:
        image = load()
    except FileError as error:
        return _Searched(reason=Reason.UNREADABLE, detail=error.message)
    if not camera.fits(image):
        height, width = image.shape
        size = message("image.size", width=width, height=height)
        return _Searched(reason=Reason.WRONG_SIZE, detail=size)
    try:
        full_scale = stated_full_scale or full_scale_of(image)
        return _Searched(
            detect_spots(image, mask, full_scale=full_scale),
            masked_lights(image, mask, full_scale),
        )
    except UNFORESEEN as error:
        return _Searched.failed(error)


def _labelled(
    searched: list[_Searched], camera: Camera, pen: Pen
) -> list[tuple[_Searched, PenDetection]]:
    """Return the images with their detections; one that fails has its reason."""
    spots = [image.spots for image in searched]
    try:
        detections = detections_of(spots, label_images(spots, camera, pen), camera)
    except UNFORESEEN as error:
        if len(searched) > 1:  # search one by one, to find which failed
            return [
                pair for image in searched for pair in _labelled([image], camera, pen)
            ]
        failed = _Searched.failed(error)
        return [(failed, unseen(pen, failed.reason))]
    return [
        (image, unseen(pen, image.reason) if image.reason else detection)
        for image, detection in zip(searched, detections, strict=True)
    ]


def _observations(
    names: tuple[str, ...], detections: list[PenDetection], lamps: FloatArray
) -> Observations:
    return Observations(
        names=names,
        pixels=np.array([detection.pixels for detection in detections]),
        seen_pixels=np.array([detection.seen_pixels for detection in detections]),
        areas=np.array([detection.areas for detection in detections]),
        sigmas=np.array([detection.sigmas for detection in detections]),
        rotations=np.array([detection.rotation for detection in detections]),
        translations=np.array([detection.translation for detection in detections]),
        edge_widths=np.array([detection.edge_width for detection in detections]),
        lamps=lamps,
        reasons=tuple(detection.reason for detection in detections),
        details=(None,) * len(detections),
    )


def _lamps_beside_pen(masked: FloatArray, detections: list[PenDetection]) -> FloatArray:
    """Return the fixed lamps of images that show the pen, (N, K, 2), px; else NaN."""
    shown = np.flatnonzero([detection.has_pose for detection in detections])
    if not len(shown):
        return np.zeros((len(detections), 0, 2))
    found = fixed_lamps(masked[shown], [detections[i] for i in shown])
    lamps = np.full((len(detections), *found.shape[1:]), np.nan)
    lamps[shown] = found
    return lamps


def _require_size(searched: list[_Searched], camera: Camera) -> None:
    if all(image.reason is Reason.UNREADABLE for image in searched):
        why = searched[0].detail
        assert why is not None
        raise FileError("images.none-readable", n_images=len(searched), why=why)
    wrong = [i.detail for i in searched if i.reason is Reason.WRONG_SIZE and i.detail]
    n_readable = sum(image.reason is not Reason.UNREADABLE for image in searched)
    if 2 * len(wrong) > n_readable:
        if camera.unbinned_size is not None:
            raise FileError(
                "images.other-than-binned",
                n_wrong=len(wrong),
                n_readable=n_readable,
                size=wrong[0],
                width=camera.width,
                height=camera.height,
                of_width=camera.unbinned_size[0],
                of_height=camera.unbinned_size[1],
            )
        raise FileError(
            "images.other-size",
            n_wrong=len(wrong),
            n_readable=n_readable,
            size=wrong[0],
            width=camera.width,
            height=camera.height,
        )


def _require_inside(pixels: FloatArray, camera: Camera) -> None:
    points = pixels[np.isfinite(pixels[..., 0])]
    near, far = points.min(axis=0, initial=0), points.max(axis=0, initial=0)
    outside = np.any((points < -0.5) | (points > camera.image_size), axis=1)
    if 2 * outside.sum() > len(points):
        raise FileError(
            "centers.outside",
            near=f"({near[0]:.0f}, {near[1]:.0f})",
            x=far[0],
            y=far[1],
            width=camera.width,
            height=camera.height,
        )


def _advice(
    reasons: tuple[Reason, ...], spots: list[Spots], camera: Camera, pen: Pen
) -> Message | None:
    if 2 * reasons.count(Reason.AMBIGUOUS) > len(reasons):
        return message("images.ambiguous")
    if 2 * reasons.count(Reason.TOO_SMALL) > len(reasons):
        width = float(np.nanmedian([found.tiny_width for found in spots]))
        return message("images.too-small", width=width, needed=MIN_WIDTH)
    return diagnose(spots, camera, pen)


def _require_right_hand(spots: list[Spots], camera: Camera, pen: Pen) -> None:
    """Refuse a mirrored pen; only its asymmetric LEDs are not found."""
    mirrored = diagnose_mirror(spots, camera, pen)
    if mirrored:
        raise CalibrationError(mirrored)
