"""Discovery: accuracy and coverage over random stations, and on rendered swings."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from benchmarks.hard_scene import rendered
from benchmarks.rows import Row, numbers
from benchmarks.tips import UM
from benchmarks.workers import Workers
from tests.simulated_disturbances import plan_disturbed
from tests.simulated_leds import with_leds
from tests.simulated_stations import (
    EXACT,
    Station,
    errors_of,
    numbers_of,
    random_station,
    seen_again,
)
from tests.simulated_swings import plan_kind

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.errors import CalibrationError
from lightpen.estimation.calibrate import calibrate
from lightpen.formats.observation_files import Centers
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.limits import USUAL
from lightpen.model.pen import Pen
from lightpen.model.rigid import fit_rigid
from lightpen_extensions.discover.discover import discover
from lightpen_extensions.discover.found import Discovery
from lightpen_extensions.discover.scale import MeasuredLength, Request
from lightpen_extensions.discover.tracks import find_spots
from lightpen_extensions.simulator.scenes import Scene

N_STATIONS = 120  # give the coverage to 2 %
N_AGAIN = 60  # of them, whose files calibrate the tip again
N_IMAGES = 300
SIGMA = 0.03  # px
NORMAL_95 = 1.959964
COVERED = (93.0, 97.0)  # per cent
TIP_LIMIT, LED_LIMIT, FOCAL_LIMIT = 12.0, 3.0, 0.03  # µm, µm rms, per cent; medians
TIME_LIMIT = 20.0  # s of processor time
OFF = 10.0  # standard deviations: a mirror image, or another wrong solution
CALIPER = 1e-4  # relative standard deviation of the length of a later calibration
N_LATER = 100  # images of that
RENDERED = ("even", "dome", "hot-spot", "hard")
RENDERED_SEEDS = (1, 2, 3)
CLEAN_LIMIT, RENDERED_LIMIT = 15.0, 30.0  # µm


@dataclass(frozen=True, eq=False)
class Outcome:
    """One station: errors in standard deviations, and what they are.

    Attributes
    ----------
    by_u, tip : (3,) array
        Error of the tip by U, and by its share of what the trial draws: noise and
        the diameter of the discs, not the lens.
    later, same : (3,) array
        Of a calibration with both files by another swing, and by the images that they
        were found from, by the same share; None beyond `N_AGAIN`.
    intrinsics : (4,) array
        Of fx, fy, cx, cy.
    """

    by_u: FloatArray
    tip: FloatArray
    later: FloatArray | None
    same: FloatArray | None
    leds: FloatArray
    intrinsics: FloatArray
    tip_error: float  # µm
    led_rms: float  # µm
    focal_error: float  # per cent
    seconds: float


def discovery_rows(workers: Workers) -> list[Row]:
    """Return accuracy, coverage and time of `lightpen discover`."""
    stations = rows_of(workers.map(outcome, range(N_STATIONS)))
    scenes = [(leds, seed) for leds in RENDERED for seed in RENDERED_SEEDS]
    return stations + rendered_rows(workers.map(rendered_error, scenes))


def rows_of(every: Sequence[Outcome | None]) -> list[Row]:
    """Return the figures of stations; None where one was refused."""
    found = [each for each in every if each is not None]
    n_wrong = sum(np.abs(each.tip).max() > OFF for each in found)
    tip = float(np.median([each.tip_error for each in found]))
    leds = float(np.median([each.led_rms for each in found]))
    focal = float(np.median([each.focal_error for each in found]))
    seconds = [each.seconds for each in found]
    stations = f"{len(every)} stations without any file, {N_IMAGES} images, {SIGMA} px"
    covered = partial(_covered, found)
    return [
        Row(
            f"{stations}: median error of tip, LEDs (rms), focal length",
            f"{tip:.1f} µm, {leds:.1f} µm, {focal:.4f} %",
            f"<= {TIP_LIMIT:g} µm, {LED_LIMIT:g} µm, {FOCAL_LIMIT:g} %",
            met=tip <= TIP_LIMIT and leds <= LED_LIMIT and focal <= FOCAL_LIMIT,
        ),
        Row(
            f"{stations}: refused; wrong mirror or other solution",
            f"{len(every) - len(found)}; {n_wrong}",
            "-; 0",
            met=n_wrong == 0,
        ),
        *(
            Row(
                f"95 % intervals of {what} cover the truth",
                f"{numbers(covered(name), 1)} %",
                f"{COVERED[0]:g} to {COVERED[1]:g} % each, but for chance",
                met=_is_met(covered(name), n),
            )
            for what, name, n in (
                (
                    "tip x y z, by the share of noise and disc diameter,",
                    "tip",
                    len(every),
                ),
                ("LED coordinates", "leds", len(every)),
                ("fx fy cx cy", "intrinsics", len(every)),
                (
                    f"tip x y z of a later calibration with both files, {N_AGAIN} of "
                    f"the stations, {N_LATER} "
                    f"images, length off by {CALIPER:.0e}, by the same share,",
                    "later",
                    N_AGAIN,
                ),
                (
                    "tip x y z of a calibration of the images that both files were "
                    f"found from, {N_AGAIN} of the stations, by the same share,",
                    "same",
                    N_AGAIN,
                ),
            )
        ),
        Row(
            "U of tip x y z, which also counts the lens, covers the truth",
            f"{numbers(covered('by_u'), 1)} %",
        ),
        Row(
            f"Processor time from centres to both files, {N_IMAGES} images: median, "
            "longest",
            f"{np.median(seconds):.1f} s, {max(seconds):.1f} s",
            f"<= {TIME_LIMIT:g} s",
            met=max(seconds) <= TIME_LIMIT,
        ),
    ]


def outcome(seed: int) -> Outcome | None:
    """Return what becomes of a station; None if it is refused."""
    station = random_station(seed, N_IMAGES, SIGMA, diameter_error=USUAL.diameter)
    start = time.process_time()
    try:
        found = station.discovered()
    except CalibrationError:
        return None
    seconds = time.process_time() - start
    errors = errors_of(found, station)
    of_leds = found.led_uncertainty[errors.order] / COVERAGE_FACTOR
    drawn = np.diag(found.covariance)[:3] - np.diag(found.beyond_fit)
    later = same = None
    if seed < N_AGAIN:
        later = _later(found, station, seed)
        same = _calibrated_with(found, found.pen, station, station.pixels)
    return Outcome(
        by_u=COVERAGE_FACTOR * errors.tip / found.expanded_uncertainty,
        tip=errors.tip / np.sqrt(drawn),
        later=later,
        same=same,
        leds=(errors.leds / of_leds).ravel(),
        intrinsics=(errors.intrinsics / found.intrinsics_sigma)[:4],
        tip_error=float(np.linalg.norm(errors.tip)) * UM,
        led_rms=errors.led_rms * UM,
        focal_error=100 * abs(float(errors.intrinsics[0])) / station.camera.fx,
        seconds=seconds,
    )


def _later(found: Discovery, station: Station, seed: int) -> FloatArray:
    """Return the error of a later calibration with both files, in deviations, (3,)."""
    rng = np.random.default_rng([30, seed])
    factor = 1 + CALIPER * float(rng.standard_normal())
    pen = replace(found.pen, leds=factor * found.pen.leds, scale_sigma=CALIPER)
    again = seen_again(station, N_LATER, SIGMA, rng)
    return _calibrated_with(found, pen, station, again.pixels, factor)


def _calibrated_with(
    found: Discovery,
    pen: Pen,
    station: Station,
    pixels: FloatArray,
    factor: float = 1.0,
) -> FloatArray:
    """Return the error of a calibration with found files, in deviations, (3,).

    The tip is one in the scale of the LED file, the factor times the true one.
    """
    order = np.argsort(errors_of(found, station).order)
    numbers = np.arange(len(pixels))
    centers = Centers(numbers, pixels[:, order], Path("simulated"))
    seen = observe_centers(centers, found.camera, pen)
    calibration = calibrate(found.camera, pen, seen)
    R, t = fit_rigid(factor * station.pen.leds[order], pen.leds)
    off = calibration.joint.tip_pen - (factor * R @ station.swing.tip_pen + t)
    sigmas = np.sqrt(np.diag(calibration.instrument.covariance)[:3])
    return np.asarray(off / sigmas)


def rendered_rows(errors: Sequence[tuple[float, float]]) -> list[Row]:
    """Return the errors of tips on rendered swings, by look of the LEDs."""
    rows = []
    for k, looks in enumerate(RENDERED):
        own = errors[k * len(RENDERED_SEEDS) : (k + 1) * len(RENDERED_SEEDS)]
        limit = CLEAN_LIMIT if looks == "even" else RENDERED_LIMIT
        tips = [error for error, _ in own]
        shares = [share for _, share in own]
        scene = "hard scenes" if looks == "hard" else f"{looks} LEDs"
        rows.append(
            Row(
                f"Rendered swings, {N_IMAGES} images, {scene}: tip error; largest "
                "share of U",
                f"{numbers(tips, 1)} µm; {max(shares):.2f}",
                f"<= {limit:g} µm; 1",
                met=max(tips) <= limit and max(shares) <= 1,
            )
        )
    return rows


def rendered_error(looks_and_seed: tuple[str, int]) -> tuple[float, float]:
    """Return the error of the tip of a rendered swing, µm, and its share of U."""
    looks, seed = looks_and_seed
    scene = Scene(n_images=N_IMAGES, seed=seed)
    if looks == "hard":
        plan = plan_disturbed(scene, kind="operator")
    else:
        plan = plan_kind(with_leds(scene, looks), "operator")
    pen = scene.pen
    longest = float(np.linalg.norm(pen.leds[:, None] - pen.leds, axis=2).max())
    request = Request((MeasuredLength(None, longest, EXACT),), pen.diameter)
    found = discover(find_spots(rendered(plan)), request)
    order = numbers_of(found.pen.leds, pen.leds)
    R, t = fit_rigid(pen.leds, found.pen.leds[order])
    off = found.tip_pen - (R @ scene.tip_pen + t)
    share = float(np.abs(off / found.expanded_uncertainty).max())
    return UM * float(np.linalg.norm(off)), share


def _is_met(covered: FloatArray, n_stations: int) -> bool:
    """Return whether coverages (k,), per cent, are right but for chance."""
    chance = 300 * np.sqrt(0.95 * 0.05 / n_stations)  # three standard errors
    low, high = COVERED
    return bool(np.all((covered >= low - chance) & (covered <= high + chance)))


def _covered(found: list[Outcome], name: str) -> FloatArray:
    """Return how many intervals cover the truth, per cent, by coordinate."""
    if name == "leds":
        every = np.concatenate([each.leds for each in found])[:, None]
    else:
        errors = (getattr(each, name) for each in found)
        every = np.array([error for error in errors if error is not None])
    return np.asarray(100 * np.mean(np.abs(every) < NORMAL_95, axis=0))
