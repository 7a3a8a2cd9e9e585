"""Discovery: accuracy and coverage over random stations."""

import time
from dataclasses import dataclass
from functools import partial

import numpy as np
from benchmarks.rows import Row, numbers
from benchmarks.tips import UM
from benchmarks.workers import Workers
from tests.simulated_stations import errors_of, random_station

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.budget import COVERAGE_FACTOR

N_STATIONS = 300
N_IMAGES = 300
SIGMA = 0.03  # px
NORMAL_95 = 1.959964
COVERED = (93.0, 97.0)  # per cent
TIP_LIMIT, LED_LIMIT, FOCAL_LIMIT = 12.0, 3.0, 0.03  # µm, µm rms, per cent; medians
TIME_LIMIT = 20.0  # s
OFF = 10.0  # standard deviations: a mirror image, or another wrong solution


@dataclass(frozen=True, eq=False)
class _Outcome:
    """One station: errors in standard deviations, and what they are."""

    tip: FloatArray
    leds: FloatArray
    intrinsics: FloatArray  # fx, fy, cx, cy
    tip_error: float  # µm
    led_rms: float  # µm
    focal_error: float  # per cent
    seconds: float


def discovery_rows(workers: Workers) -> list[Row]:
    """Return accuracy, coverage and time of `lightpen discover` on centres."""
    every = workers.map(_outcome, range(N_STATIONS))
    found = [each for each in every if each is not None]
    n_refused = N_STATIONS - len(found)
    n_wrong = sum(np.abs(each.tip).max() > OFF for each in found)
    tip = float(np.median([each.tip_error for each in found]))
    leds = float(np.median([each.led_rms for each in found]))
    focal = float(np.median([each.focal_error for each in found]))
    seconds = float(np.median([each.seconds for each in found]))
    stations = f"{N_STATIONS} stations without any file, {N_IMAGES} images, {SIGMA} px"
    low, high = COVERED
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
            f"{n_refused}; {n_wrong}",
            "-; 0",
            met=n_wrong == 0,
        ),
        *(
            Row(
                f"95 % intervals of {what} cover the truth",
                f"{numbers(covered(name), 1)} %",
                f"{low:g} to {high:g} % each",
                met=bool(np.all((covered(name) >= low) & (covered(name) <= high))),
            )
            for what, name in (
                ("tip x y z", "tip"),
                ("LED coordinates", "leds"),
                ("fx fy cx cy", "intrinsics"),
            )
        ),
        Row(
            f"Time from centres to pen and camera, {N_IMAGES} images, median",
            f"{seconds:.1f} s",
            f"<= {TIME_LIMIT:g} s",
            met=seconds <= TIME_LIMIT,
        ),
    ]


def _outcome(seed: int) -> _Outcome | None:
    """Return what becomes of a station; None if it is refused."""
    station = random_station(seed, N_IMAGES, SIGMA)
    start = time.perf_counter()
    try:
        found = station.discovered()
    except CalibrationError:
        return None
    seconds = time.perf_counter() - start
    errors = errors_of(found, station)
    of_leds = found.led_uncertainty[errors.order] / COVERAGE_FACTOR
    return _Outcome(
        tip=COVERAGE_FACTOR * errors.tip / found.expanded_uncertainty,
        leds=(errors.leds / of_leds).ravel(),
        intrinsics=(errors.intrinsics / found.intrinsics_sigma)[:4],
        tip_error=float(np.linalg.norm(errors.tip)) * UM,
        led_rms=errors.led_rms * UM,
        focal_error=100 * abs(float(errors.intrinsics[0])) / station.camera.fx,
        seconds=seconds,
    )


def _covered(found: list[_Outcome], name: str) -> FloatArray:
    """Return how many intervals cover the truth, per cent, by coordinate."""
    if name == "leds":
        every = np.concatenate([each.leds for each in found])[:, None]
    else:
        every = np.array([getattr(each, name) for each in found])
    return np.asarray(100 * np.mean(np.abs(every) < NORMAL_95, axis=0))
