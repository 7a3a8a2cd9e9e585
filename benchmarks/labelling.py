"""Random views of the pen as spots with known labels: right, refused or wrong."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from benchmarks.rows import Row
from benchmarks.workers import Workers

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.labelling.labels import Labels, label_images
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import Spots
from lightpen.model.ellipse import disc_images
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import paper_camera, paper_pen

CAMERA = paper_camera()
PEN = paper_pen()
N_VIEWS = 2000
CHUNK = 250
SIGMA = 0.03  # px
LED_SIGMA = 0.01  # mm
SHAPE_NOISE = 0.005  # of the area
MAX_TILT = np.radians(40)  # from the camera's axis
MIDDLE = np.array([[-150.0, -120.0, 850.0], [150.0, 120.0, 1300.0]])  # mm
MIN_FACING = np.cos(np.radians(70))
MARGIN = 60.0  # px, to the border of the image
LAMP_REACH = 80.0  # px, beyond the LEDs
LAMP_GAP = 45.0  # px, to other spots
KINDS = {  # LEDs missing, lamps
    "all LEDs": (0, 0),
    "4 LEDs missing": (4, 0),
    "5 foreign lamps": (0, 5),
    "4 LEDs missing and 5 foreign lamps": (4, 5),
}


@dataclass(frozen=True, eq=False)
class RandomView:
    """The spots of one image and the truth about them.

    Attributes
    ----------
    spot : (L,) array
        Spot of each LED, -1 where it is missing.
    R, t : (3, 3) and (3,) array
        cam_from_pen, mm.
    """

    spots: Spots
    spot: IntArray
    R: FloatArray
    t: FloatArray


def labelling_rows(workers: Workers) -> list[Row]:
    """Return how often views are labelled rightly, refused, or wrongly."""
    rows = []
    seeds = range(N_VIEWS // CHUNK)
    for name, (n_missing, n_lamps) in KINDS.items():
        jobs = [(seed, n_missing, n_lamps) for seed in seeds]
        found = sum(workers.map(_outcomes, jobs), Counter[str]())
        rows.append(
            Row(
                f"{N_VIEWS} random views, {name}: correctly, not, wrongly labelled",
                f"{found['right']}, {found['refused']}, {found['wrong']}",
                "0 wrongly",
                met=found["wrong"] == 0,
            )
        )
    return rows


def random_view(rng: np.random.Generator, n_missing: int, n_lamps: int) -> RandomView:
    """Return a view with LEDs missing and, among them, lamps of their size."""
    R, t = _random_pose(rng)
    leds = PEN.leds + rng.normal(0, LED_SIGMA, PEN.leds.shape)
    discs = disc_images(CAMERA, leds @ R.T + t, PEN.normals @ R.T, PEN.diameter / 2)
    seen = np.sort(rng.permutation(PEN.n_leds)[n_missing:])
    centers = list(discs.centers[seen] + rng.normal(0, SIGMA, (len(seen), 2)))
    scales = 1 + rng.normal(0, SHAPE_NOISE, (len(seen), 1, 1))
    shapes = list(discs.shapes[seen] * scales)
    low = discs.centers.min(axis=0) - LAMP_REACH
    high = discs.centers.max(axis=0) + LAMP_REACH
    while len(centers) < len(seen) + n_lamps:
        place = rng.uniform(low, high)
        if np.linalg.norm(np.array(centers) - place, axis=1).min() > LAMP_GAP:
            centers.append(place)
            shapes.append(discs.shapes[rng.integers(PEN.n_leds)])
    order = rng.permutation(len(centers))
    spot = np.full(PEN.n_leds, -1)
    spot[seen] = np.argsort(order)[: len(seen)]
    return RandomView(
        spots_at(np.array(centers)[order], np.array(shapes)[order]), spot, R, t
    )


def outcome(labels: Labels, view: RandomView) -> str:
    """Return whether an image was labelled right, wrong, or refused."""
    if labels.reason is not Reason.NONE:
        return "refused"
    named = labels.spot >= 0
    right = np.array_equal(labels.spot[named], view.spot[named])
    return "right" if right else "wrong"


def _outcomes(job: tuple[int, int, int]) -> Counter[str]:
    seed, n_missing, n_lamps = job
    rng = np.random.default_rng([seed, n_missing, n_lamps])
    views = [random_view(rng, n_missing, n_lamps) for _ in range(CHUNK)]
    labels = label_images([view.spots for view in views], CAMERA, PEN)
    return Counter(map(outcome, labels, views))


def _random_pose(rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return a pose with all LEDs in the image and facing the camera."""
    facing = np.diag([1.0, -1.0, -1.0])
    size = np.array([CAMERA.width, CAMERA.height])
    while True:
        tilt, direction = MAX_TILT * rng.random(), 2 * np.pi * rng.random()
        axis = np.array([np.cos(direction), np.sin(direction), 0.0])
        roll = np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
        R = rotation_from_vector(tilt * axis) @ rotation_from_vector(roll) @ facing
        t = rng.uniform(*MIDDLE) - R @ PEN.leds.mean(axis=0)
        leds = PEN.leds @ R.T + t
        lengths = np.linalg.norm(leds, axis=1)
        cosines = -np.sum(PEN.normals @ R.T * leds, axis=1) / lengths
        pixels = CAMERA.project(leds)
        inside = np.all((pixels > MARGIN) & (pixels < size - MARGIN))
        if inside and cosines.min() > MIN_FACING:
            return R, t


def spots_at(centers: FloatArray, shapes: FloatArray) -> Spots:
    """Return whole, sharp spots with centres (N, 2), px, and shapes (N, 2, 2), px^2."""
    n = len(centers)
    return Spots(
        centers=centers,
        shapes=shapes,
        areas=4 * np.pi * np.sqrt(np.linalg.det(shapes)),
        contrasts=np.full(n, 0.8),
        edge_widths=np.full(n, 2.0),
        flaws=np.zeros(n, dtype=np.int64),
        sigmas=np.full(n, 0.01),
        offsets=np.zeros((n, 2)),
    )
