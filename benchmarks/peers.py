"""Reference methods: OpenCV's blobs, grey centroids, plain pivots."""

import cv2
import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

BLOB_STEP = 3.0  # grey values from threshold to threshold; more exact than 1 or 10
DEFAULT_BLOB_STEP = 10.0  # OpenCV's
BLOB_LEVELS = (20.0, 220.0)
BLOB_AREAS = (100.0, 10_000.0)  # px^2
BLOB_CIRCULARITY = 0.8  # keeps out discs that merge at low thresholds
CENTROID_LEVEL = 30  # grey value
CENTROID_MARGIN = 4  # px
PITCH = 2.5  # of LEDs on a panel, in widths
UNCLIPPED = 250  # grey value
REACH = 10.0  # px, of a found centre from the true one


def blob_detector(step: float = BLOB_STEP) -> cv2.SimpleBlobDetector:
    """Return OpenCV's blob detector, set to bright discs; step in grey values."""
    settings = cv2.SimpleBlobDetector.Params()
    settings.filterByColor = True
    settings.blobColor = 255
    settings.minThreshold, settings.maxThreshold = BLOB_LEVELS
    settings.thresholdStep = step
    settings.filterByArea = True
    settings.minArea, settings.maxArea = BLOB_AREAS
    settings.filterByCircularity = True
    settings.minCircularity = BLOB_CIRCULARITY
    settings.filterByConvexity = False
    settings.filterByInertia = False
    return cv2.SimpleBlobDetector.create(settings)


def blob_centers(detector: cv2.SimpleBlobDetector, image: Image) -> FloatArray:
    """Return what the detector finds, (N, 2), px."""
    return np.array([blob.pt for blob in detector.detect(image)]).reshape(-1, 2)


def grey_centroids(image: Image) -> FloatArray:
    """Return the grey-weighted centroids of bright regions, (N, 2), px."""
    _, bright = cv2.threshold(image, CENTROID_LEVEL, 255, cv2.THRESH_BINARY)
    contours, _ = cv2.findContours(bright, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    centers = []
    for contour in contours:
        x, y, width, height = cv2.boundingRect(contour)
        if width * height < BLOB_AREAS[0]:
            continue
        left, top = max(x - CENTROID_MARGIN, 0), max(y - CENTROID_MARGIN, 0)
        right, bottom = x + width + CENTROID_MARGIN, y + height + CENTROID_MARGIN
        window = image[top:bottom, left:right]
        disc = np.zeros(window.shape, np.uint8)
        cv2.drawContours(disc, [contour], 0, 1, cv2.FILLED, offset=(-left, -top))
        weights = window * cv2.dilate(disc, np.ones((3, 3), np.uint8))
        moments = cv2.moments(weights.astype(np.float32))
        centers.append(
            (
                left + moments["m10"] / moments["m00"],
                top + moments["m01"] / moments["m00"],
            )
        )
    return np.array(centers).reshape(-1, 2)


def grey_centroids_at(image: Image, places: FloatArray, width: float) -> FloatArray:
    """Return the centroids of light above an eighth of its height, (N, 2), px.

    Parameters
    ----------
    places : (N, 2) array
        Of the LEDs, roughly, px.
    width : float
        Of an LED, px.
    """
    half = int(np.ceil(0.5 * PITCH * width))
    centers = []
    for x, y in np.rint(places).astype(int).tolist():
        left, top = max(x - half, 0), max(y - half, 0)
        window = image[top : y + half + 1, left : x + half + 1].astype(float)
        window -= window.min()
        light = np.maximum(window - window.max() / 8, 0)
        _, parts = cv2.connectedComponents((light > 0).astype(np.uint8))
        light[parts != parts[y - top, x - left]] = 0
        rows, columns = np.mgrid[: light.shape[0], : light.shape[1]]
        amount = max(light.sum(), 1e-9)
        centers.append(
            (
                left + (light * columns).sum() / amount,
                top + (light * rows).sum() / amount,
            )
        )
    return np.array(centers)


def gaussian_fits(
    image: Image, places: FloatArray, width: float, blur: float
) -> FloatArray:
    """Return the centres of elliptic Gaussians by least squares, (N, 2), px.

    Clipped pixels are left out; else as of `grey_centroids_at`.
    """
    half = int(np.ceil(width / 2 + 1.5 * blur))
    variance = (width / 4) ** 2 + blur**2
    centers = []
    for place in places:
        x, y = np.rint(place).astype(int).tolist()
        rows, columns = np.mgrid[
            max(y - half, 0) : min(y + half + 1, image.shape[0]),
            max(x - half, 0) : min(x + half + 1, image.shape[1]),
        ]
        light = image[rows, columns].astype(float)
        used = light < UNCLIPPED
        found = _gaussian(columns[used], rows[used], light[used], place, variance)
        is_near = np.linalg.norm(found - place) < width / 2
        centers.append(found if is_near else place)
    return np.array(centers)


def _gaussian(
    x: FloatArray, y: FloatArray, light: FloatArray, place: FloatArray, variance: float
) -> FloatArray:
    from scipy.optimize import least_squares  # takes 0.2 s

    def misfit(p: FloatArray) -> FloatArray:
        u, v = x - p[0], y - p[1]
        power = p[4] * u**2 + 2 * p[5] * u * v + p[6] * v**2
        return np.asarray(p[2] * np.exp(-0.5 * np.minimum(power, 80)) + p[3] - light)

    shape = [np.ptp(light), light.min(), 1 / variance, 0, 1 / variance]
    fit = least_squares(misfit, [*place, *shape], max_nfev=60)
    return np.asarray(fit.x[:2])


def nearest(found: FloatArray, true: FloatArray) -> FloatArray:
    """Return the found centre (L, 2) nearest to each true one, NaN beyond `REACH`."""
    if not len(found):
        return np.full_like(true, np.nan)
    gaps = np.linalg.norm(found - true[:, None], axis=2)
    near = gaps.min(axis=1) < REACH
    return np.where(near[:, None], found[gaps.argmin(axis=1)], np.nan)


def solve_pnp(camera: Camera, pen: Pen, centers: FloatArray) -> None:
    """Solve the pose as OpenCV does by default; centres (L, 2), px, NaN if missing."""
    seen = np.isfinite(centers[:, 0])
    cv2.solvePnP(pen.leds[seen], centers[seen], camera.matrix, camera.distortion)
