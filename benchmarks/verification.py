"""Verifications: the paper's tables on the image sets, and touches by Monte Carlo."""

from functools import partial
from pathlib import Path

import numpy as np
from benchmarks.rows import Row, numbers, without_data
from benchmarks.touches import covered_share
from benchmarks.whole_verification import verified
from benchmarks.workers import Workers

from lightpen.detection.observations import observe_images
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.camera_files import read_camera
from lightpen.formats.images import find_images
from lightpen.formats.pen_files import read_pen
from lightpen.model.artefacts import Artefact, ArtefactKind
from lightpen_extensions.measure.probing.probing import ProbingRules
from lightpen_extensions.measure.probing.sources import (
    ProbingRun,
    observe_place,
    touch_place,
    touches_of,
)
from lightpen_extensions.measure.tasks.fixed_point import measure_fixed_point
from lightpen_extensions.measure.tasks.part import sizes_of
from lightpen_extensions.measure.tasks.registry import measure_artefacts
from lightpen_extensions.measure.tasks.task import Conditions

UM = 1000.0  # in a millimetre
ONE_IMAGE = ProbingRules(n_frames=1, n_settling=0)
NOMINAL_TIP = np.array([0.0, -90.0, -25.0])  # mm, the paper's
POINT_LIMITS = np.array([2.0, 2.0, 10.0])  # µm
RADIUS, ERROR_LIMIT, SCATTER_LIMIT, N_RUNS = 31.751, 1.5, 1.0, 8  # mm, µm
N_PARTS, N_CALIBRATIONS, N_TOUCHES = 10, 10, 10
SHARE_LIMITS = 0.93, 0.97
LONGEST = 180.0  # s of the operator's time
FIGURES = (
    "`fixed-point`: std of u v w by the tip of `swing-full`",
    "`circle`: mean radius error, std of 8 runs",
)


def verification_rows(workers: Workers, data: Path | None) -> list[Row]:
    """Return the figures of fixed point, circle and touches."""
    rows = without_data(*FIGURES) if data is None else _of_sets(data)
    count = partial(_covered, N_CALIBRATIONS, N_TOUCHES)
    share = float(np.mean(workers.map(count, list(range(N_PARTS)))))
    low, high = SHARE_LIMITS
    whole = verified()
    return [
        *rows,
        Row(
            "verified by the simulated operator: cone, ring, length, without a key",
            f"{whole.seconds:.0f} s",
            f"{LONGEST:.0f} s",
            met=whole.is_done and whole.is_accepted and whole.seconds <= LONGEST,
        ),
        Row(
            f"{N_PARTS * N_CALIBRATIONS * N_TOUCHES} touches: in their 95 % ellipsoid",
            f"{100 * share:.1f} %",
            f"{100 * low:.0f} to {100 * high:.0f} %",
            met=low <= share <= high,
        ),
    ]


def _covered(n_calibrations: int, n_touches: int, seed: int) -> float:
    return covered_share(n_calibrations, n_touches, seed)


def _of_sets(data: Path) -> list[Row]:
    instrument = _instrument(data / "swing-full")
    conditions = Conditions(instrument, nominal_tip=NOMINAL_TIP)
    touched = _touched(data / "fixed-point" / "images", instrument)
    point = measure_fixed_point([(touched.name, touched.touches)], conditions)
    runs = [
        _touched(data / "circle" / f"run_{i:02d}", instrument)
        for i in range(1, N_RUNS + 1)
    ]
    ring = Artefact(ArtefactKind.RING, RADIUS)
    named = [(run.name, run.touches) for run in runs]
    circle = measure_artefacts("ring", N_RUNS * [ring], named, conditions)
    errors = np.array([each.deviation for each in sizes_of(circle.part)])
    deviation = UM * point.calibrated.deviation
    assert point.nominal is not None
    error, scatter = UM * errors.mean(), UM * errors.std(ddof=1)
    return [
        Row(
            FIGURES[0],
            f"{numbers(deviation, 1)} µm",
            f"{numbers(POINT_LIMITS, 0)} µm",
            f"nominal tip {numbers(UM * point.nominal.deviation, 0)} µm",
            met=bool((deviation <= POINT_LIMITS).all()),
        ),
        Row(
            FIGURES[1],
            f"{error:+.1f}, {scatter:.1f} µm",
            f"{ERROR_LIMIT:g}, {SCATTER_LIMIT:g} µm",
            "paper 17, 8 µm",
            met=abs(error) <= ERROR_LIMIT and scatter <= SCATTER_LIMIT,
        ),
    ]


def _instrument(folder: Path) -> Instrument:
    camera = read_camera(folder / "camera.yaml")
    pen = read_pen(folder / "leds.csv")
    images = find_images(str(folder / "images"))
    return calibrate(camera, pen, observe_images(images, camera, pen)).instrument


def _touched(folder: Path, instrument: Instrument) -> ProbingRun:
    place = touch_place((str(folder),))
    return touches_of(
        place.name, observe_place(place, instrument), instrument, ONE_IMAGE
    )
