"""Times on one core: from image to pose, fits, rendering."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from benchmarks.image_sets import read_image_set
from benchmarks.labelling import CAMERA, PEN, RandomView, random_view
from benchmarks.live_load import live_loads
from benchmarks.peers import (
    DEFAULT_BLOB_STEP,
    blob_centers,
    blob_detector,
    nearest,
    solve_pnp,
)
from benchmarks.rows import Row, without_data
from benchmarks.workers import Workers, elapsed_ms, median_ms
from tests.simulated_centers import simulate_centers
from tests.simulated_leds import LEDS, with_leds
from tests.simulated_plans import live_plan

from lightpen.arrays import FloatArray, Image
from lightpen.detection.labelling.labels import Labels, label_spots
from lightpen.detection.observations import observe_centers, observe_images
from lightpen.detection.pen_detection import (
    PenDetection,
    detect_from_centers,
    detect_pen,
    follow_spots,
)
from lightpen.detection.pose import fit_paper_poses, fit_poses
from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.contact.joint import ContactModel, fit_contact
from lightpen.estimation.pivot.pivot import fit_pivot, fit_two_stage
from lightpen.formats.observation_files import Centers
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.rigid import Rig, rig_of, rotation_from_vector
from lightpen.swing.capture.kept_images import AcceptedImages, keep, kept_before
from lightpen_extensions.simulator.image_plans import ImagePlan, render_plan
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import leds_in_camera, swing_poses

N_IMAGES = 50  # of the camera, at 20 a second
FRAME_RATE = 20.0
N_VIEWS = 200  # spots to label
TURN_ERROR = 0.01  # rad per axis, of a predicted pose: LEDs are some 10 px off
N_FRAMES = 300
N_MORE = 20  # of these, that come one after the other
SIGMA = 0.05  # px
REPEATS = 15
RPG = "rpg_monocular_pose_estimator (on other images, not run here) some"
SCENE = Scene()

# Times that cv2.minMaxLoc takes for the same images, in the same process.
MOST_PASSES = {"tracking": 25.0, "tracking look": 40.0, "start": 90.0}
MOST_LIVE = 0.12  # of a core, for images
SLOWEST_LOOK = 2.0  # times as long from nothing as even LEDs
LIMITS_MS = {
    "start labels": 20.0,
    "tracking labels": 1.0,
    "joint": 50.0,
    "calibration": 400.0,
    "extend": 8.0,
    "render": 1000 / FRAME_RATE,
}


@dataclass(frozen=True)
class _ImageTimes:
    """Median times of one image, ms."""

    one_pass: float  # cv2.minMaxLoc
    tracking: float
    start: float
    blobs: float
    default_blobs: float
    render: float


@dataclass(frozen=True)
class _LookTimes:
    """Median times of one image of LEDs of one look, ms."""

    one_pass: float
    tracking: float
    start: float


@dataclass(frozen=True)
class _LabelTimes:
    """Median times of the labels of one image, ms."""

    start: float
    tracking: float


@dataclass(frozen=True)
class _FitTimes:
    """Median times of fits to N_FRAMES images, ms."""

    joint: float
    extend: float
    longest: float  # of these
    two_stage: float


def speed_rows(workers: Workers, data: Path | None) -> list[Row]:
    """Return the times that the program takes on one core."""
    images = workers.call(_image_times)
    labels = workers.call(_label_times)
    fits = workers.call(_fit_times)
    looks = workers.call(_look_times)
    with_images, without = workers.call(live_loads)
    even = looks["even"].start
    peer = (
        f"cv2.SimpleBlobDetector and cv2.solvePnP {images.blobs:.1f}, at its default "
        f"step {images.default_blobs:.1f}"
    )
    return [
        _passes_row(
            "5 MP image to pose, tracking",
            *("tracking", images.tracking, images.one_pass, peer),
        ),
        *(
            _passes_row(
                f"- tracking, LEDs of the look `{look}`",
                *("tracking look", times.tracking, times.one_pass),
            )
            for look, times in looks.items()
        ),
        _passes_row(
            "5 MP image to pose, from nothing",
            *("start", images.start, images.one_pass, peer),
        ),
        *(
            Row(
                f"- from nothing, LEDs of the look `{look}`",
                f"{times.start:.2f} ms, {times.start / even:.1f} times even ones",
                f"<= {SLOWEST_LOOK:g} times",
                met=times.start <= SLOWEST_LOOK * even,
            )
            for look, times in looks.items()
        ),
        Row(
            "live pipeline, 20 images/s of 5 MP of a moving pen: share of a core",
            f"{with_images - without:.1%}: {with_images:.1%} with images, "
            f"{without:.1%} without",
            f"<= {MOST_LIVE:.0%}",
            met=with_images - without <= MOST_LIVE,
        ),
        _row(
            "labels from nothing, 4 LEDs missing and 5 foreign lamps",
            labels.start,
            "start labels",
            f"{RPG} 200",
        ),
        _row(
            "labels and pose of the same when tracking",
            labels.tracking,
            "tracking labels",
            f"{RPG} 1",
        ),
        _row(
            f"joint fit of {N_FRAMES} images",
            fits.joint,
            "joint",
            f"two-stage (paper) {fits.two_stage:.1f}",
        ),
        *_calibration_rows(workers, data),
        _row(
            f"one image more of a swing, with U, mean of {N_MORE}",
            *(fits.extend, "extend", f"the longest of them {fits.longest:.1f}"),
        ),
        _row("simulator, one 5 MP image with noise", images.render, "render"),
    ]


def _calibration_rows(workers: Workers, data: Path | None) -> list[Row]:
    what = "whole calibration of `swing-full` from its centres"
    if data is None:
        return without_data(what)
    time_ms = workers.call(partial(_calibration_time, data / "swing-full"))
    return [_row(what, time_ms, "calibration")]


def _calibration_time(folder: Path) -> float:
    given = read_image_set(folder)
    seen = observe_images(given.images, given.camera, given.pen)
    return median_ms(lambda: calibrate(given.camera, given.pen, seen), REPEATS)


def _row(what: str, time_ms: float, limit: str, others: str = "") -> Row:
    limit_ms = LIMITS_MS[limit]
    return Row(
        what, f"{time_ms:.2f} ms", f"<= {limit_ms:g} ms", others, time_ms <= limit_ms
    )


def _passes_row(
    what: str, limit: str, time_ms: float, one_pass_ms: float, others: str = ""
) -> Row:
    """Return a time beside its ratio to one pass over the image."""
    n_passes, most = time_ms / one_pass_ms, MOST_PASSES[limit]
    return Row(
        what,
        f"{time_ms:.2f} ms, {n_passes:.0f} times cv2.minMaxLoc",
        f"<= {most:g} times",
        others,
        n_passes <= most,
    )


def _image_times() -> _ImageTimes:
    image_plans = [live_plan(SCENE, i, i / FRAME_RATE) for i in range(N_IMAGES)]
    images = [render_plan(SCENE, image_plan) for image_plan in image_plans]
    blobs, default_blobs = blob_detector(), blob_detector(DEFAULT_BLOB_STEP)

    start = partial(_found, images)
    detections = [start(i) for i in range(N_IMAGES)]

    def solve(detector: cv2.SimpleBlobDetector, i: int) -> None:
        found = blob_centers(detector, images[i])
        solve_pnp(CAMERA, PEN, nearest(found, _true_centers(image_plans[i])))

    def render(i: int) -> Image:
        return render_plan(SCENE, live_plan(SCENE, i, i / FRAME_RATE))

    return _ImageTimes(
        one_pass=_one_pass(images),
        tracking=_median_over_images(partial(_tracked, images, detections)),
        start=_median_over_images(start),
        blobs=_median_over_images(partial(solve, blobs)),
        default_blobs=_median_over_images(partial(solve, default_blobs)),
        render=_median_over_images(render),
    )


def _look_times() -> dict[str, _LookTimes]:
    """Return the times of each look of LEDs."""
    times = {}
    for name in LEDS:
        scene = with_leds(SCENE, name)
        plans = [live_plan(scene, i, i / FRAME_RATE) for i in range(N_IMAGES)]
        images = [render_plan(scene, plan) for plan in plans]
        detections = [detect_pen(image, CAMERA, PEN) for image in images]

        times[name] = _LookTimes(
            _one_pass(images),
            _median_over_images(partial(_tracked, images, detections)),
            _median_over_images(partial(_found, images)),
        )
    return times


def _one_pass(images: list[Image]) -> float:
    """Return the median time of one pass over an image that is in the cache, ms."""
    return statistics.median(
        min(elapsed_ms(partial(cv2.minMaxLoc, image)) for _ in range(REPEATS))
        for image in images
    )


def _found(images: list[Image], i: int) -> PenDetection:
    return detect_pen(images[i], CAMERA, PEN)


def _tracked(
    images: list[Image], detections: list[PenDetection], i: int
) -> PenDetection:
    before = detections[i - 1]
    return detect_pen(images[i], CAMERA, PEN, None, before, is_followed=True)


def _median_over_images(function: Callable[[int], object]) -> float:
    """Return the median time of a call over the images but the first, ms."""
    function(1)
    times = [elapsed_ms(partial(function, i)) for i in range(1, N_IMAGES)]
    return statistics.median(times)


def _true_centers(image_plan: ImagePlan) -> FloatArray:
    leds, normals = leds_in_camera(PEN, image_plan.rotation, image_plan.translation)
    return ellipse_centers(CAMERA, leds, normals, PEN.diameter / 2)


def _label_times() -> _LabelTimes:
    rng = np.random.default_rng(3)
    views = [random_view(rng, n_missing=4, n_lamps=5) for _ in range(N_VIEWS)]
    turns = rotation_from_vector(rng.normal(0, TURN_ERROR, (N_VIEWS, 3)))
    middle, unseen = PEN.leds.mean(axis=0), np.full((PEN.n_leds, 2), np.nan)

    def start(view: RandomView) -> Labels:
        return label_spots(view.spots, CAMERA, PEN)

    def track(view: RandomView, turn: FloatArray) -> PenDetection | None:
        R = turn @ view.R
        t = view.t + (view.R - R) @ middle
        before = PenDetection(unseen, unseen, Reason.NONE, R, t)
        return follow_spots(view.spots, CAMERA, PEN, before)

    starting = [elapsed_ms(partial(start, view)) for view in views]
    tracking = [
        elapsed_ms(partial(track, view, turn))
        for view, turn in zip(views, turns, strict=True)
    ]
    return _LabelTimes(statistics.median(starting), statistics.median(tracking))


def _times_of_more(
    rig: Rig, kept: AcceptedImages, more: list[PenDetection]
) -> FloatArray:
    """Return the median time to keep each of more images, ms."""
    times = []
    for _ in range(REPEATS):
        longer = kept
        for i, each in enumerate(more):
            start = time.perf_counter()
            longer = keep(rig, PEN, longer, each, N_FRAMES + i, 0.1 * i)
            times.append(1000 * (time.perf_counter() - start))
    return np.asarray(np.median(np.reshape(times, (REPEATS, -1)), axis=0))


def _fit_times() -> _FitTimes:
    rng = np.random.default_rng(4)
    swing = swing_poses(N_FRAMES, rng)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, SIGMA, rng
    )
    centers = Centers(np.arange(N_FRAMES), pixels, Path("simulated"))
    seen = observe_centers(centers, CAMERA, PEN)
    poses = fit_poses(CAMERA, PEN, pixels, seen.rotations, seen.translations)
    pivot = fit_pivot(poses.rotations, poses.translations, poses.covariances)
    R, tip, cone = poses.rotations, pivot.tip_pen, pivot.pivot_cam
    rig, places = rig_of(CAMERA), poses.translations
    first = slice(0, N_FRAMES - N_MORE)
    numbers = np.arange(first.stop)
    kept = kept_before(rig, PEN, numbers, pixels[first, None], R[first], places[first])
    more = [
        detect_from_centers(CAMERA, PEN, pixels[i], R[i], places[i])
        for i in range(first.stop, N_FRAMES)
    ]
    extend = _times_of_more(rig, kept, more)

    def two_stage() -> None:
        paper = fit_paper_poses(CAMERA, PEN, pixels, R, poses.translations)
        fit_two_stage(paper.rotations, paper.translations)

    return _FitTimes(
        joint=median_ms(
            lambda: fit_contact(ContactModel.of(CAMERA, PEN, pixels), R, tip, cone),
            REPEATS,
        ),
        extend=float(extend.mean()),
        longest=float(extend.max()),
        two_stage=median_ms(two_stage, REPEATS),
    )
