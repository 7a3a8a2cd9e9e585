"""The LEDs of a pen over its swings: whether one was knocked, or all grew together.

Each calibration gives the displacement of each LED from its place in the file, except
a move of the whole pen and, with one camera, its scale. What changed from the first
swing on is stated by LED after the best move and scale of all are removed.

The scale shows elsewhere. With a pen that grew by e since its LEDs were measured all
distances come out smaller by e: a cone that stayed where it was seems to come nearer
along its line of sight, ``w / f`` smaller, at the same place in the image. How well
that repeats from swing to swing, their records state; a pen grew if the difference is
more than chance and matters.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError, FileError, UsageError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.opened_files import hashed
from lightpen.messages import message
from lightpen.model.camera import Camera
from lightpen.model.coverage import COVERAGE_FACTOR, normal_quantile
from lightpen.model.names import Origin
from lightpen.model.pen import Pen
from lightpen.model.rigid import skew
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import Preparation
from lightpen_extensions.comparisons.assessment import (
    VerificationAssessment,
    accepted,
    check,
    refused,
)

MIN_SWINGS = 2
MOST = 20  # swings of a pen that are read, the newest
MOVED = 0.02  # mm, from which on an LED has moved
STANDS_OUT = 5.0  # times the median change of all LEDs
GROWN = 6e-5  # relative, from which on it matters: 0.006 mm of a tip 100 mm away
BY_CHANCE = 0.01  # probability that an unchanged pen seems to have grown
SAME_PLACE = 0.5  # px, in which a cone stays that did not move
ALUMINIUM = 23e-6  # relative growth per K
ROUNDS = 20
MEASURE_AGAIN = message("pen-health.measure-again")
MEASURE_LENGTH = message("pen-health.measure-length")
KEEP_FILE = message("pen-health.keep-file")


class Growth(NamedTuple):
    """A change of the pen's size, and U (k = 2) of it, relative."""

    relative: float
    uncertainty: float


@dataclass(frozen=True, eq=False)
class SwingOfPen:
    """The state of a pen by one swing, relative to the first."""

    name: str
    shifts: FloatArray  # (L, 3), of LEDs since the first swing, mm; NaN if not seen
    # Since the first swing that determines it; None for that swing, if cone or camera
    # was moved, if the images contradict a file, or with several cameras.
    growth: Growth | None


@dataclass(frozen=True, eq=False)
class PenHealth:
    """A pen over its swings."""

    swings: tuple[SwingOfPen, ...]
    moved: tuple[int, ...]  # numbers of the LEDs that moved, from 1
    growth: Growth | None  # most significant; None where not determined
    assessment: VerificationAssessment


def examine_pen(
    calibrations: Sequence[CalibrationFile], camera: Camera | None, leds: FloatArray
) -> PenHealth:
    """Examine a pen by at least two calibrations, the oldest first.

    ``camera`` is the common camera of all swings, from its file; without it the growth
    is not determined. ``leds`` (L, 3), mm, are the LEDs of the pen file. Raises
    `UsageError` for different pens.
    """
    require_one_pen(calibrations)
    if len(calibrations) < MIN_SWINGS:
        raise CalibrationError("pen-health.too-few")
    first, sized = calibrations[0], next(filter(_has_size, calibrations), None)
    swings = [
        SwingOfPen(
            name=each.path.name,
            shifts=_without_move(leds, each.displacements - first.displacements),
            growth=_growth(sized, each, camera) if camera and sized else None,
        )
        for each in calibrations
    ]
    lengths = np.array([np.linalg.norm(each.shifts, axis=1) for each in swings])
    usual = np.nanmedian(lengths[1:], axis=1, keepdims=True)
    stands_out = np.nan_to_num(lengths[1:]) > np.maximum(STANDS_OUT * usual, MOVED)
    moved = tuple((np.flatnonzero(stands_out.any(axis=0)) + 1).tolist())
    growths = [each.growth for each in swings if each.growth is not None]
    growth = max(growths, key=lambda g: abs(g.relative) / g.uncertainty, default=None)
    return PenHealth(
        swings=tuple(swings),
        moved=moved,
        growth=growth,
        assessment=_assessment(swings, moved, growth, len(growths)),
    )


@dataclass(frozen=True, eq=False)
class PenOverTime:
    """A pen over its accepted swings with the LED file that is chosen."""

    names: Names
    is_simulated: bool
    pen: Pen
    pen_sha256: str
    swings: tuple[CalibrationFile, ...]  # the oldest first
    n_left_out: int  # with another LED file, or unreadable
    health: PenHealth | None  # None of fewer than two swings


def read_pen_over_time(
    archive: FolderArchive, preparation: Preparation, report: Callable[[float], None]
) -> PenOverTime:
    """Read the accepted swings of the pen that is chosen."""
    pen_file, camera_file = preparation.pen_file, preparation.camera_file
    if pen_file is None:
        raise ValueError("`pen_file` must be chosen.")
    pen_sha256 = hashed(pen_file.path).sha256
    is_simulated = preparation.origin is Origin.SIMULATED
    names = preparation.names
    files = archive.files_of_pen(names.pen, is_simulated=is_simulated)[:MOST]
    found: list[CalibrationFile] = []
    for n, file in enumerate(files, start=1):
        with suppress(FileError, UsageError):  # reported by whoever reads the archive
            swing = read_calibration(file)
            if swing.pen_sha256 == pen_sha256:
                found.append(swing)
        report(n / len(files))
    swings = tuple(sorted(found, key=lambda swing: swing.when))
    camera = None if camera_file is None else camera_file.camera
    return PenOverTime(
        names=names,
        is_simulated=is_simulated,
        pen=pen_file.pen,
        pen_sha256=pen_sha256,
        swings=swings,
        n_left_out=len(files) - len(swings),
        health=(
            examine_pen(swings, camera, pen_file.pen.leds)
            if len(swings) >= MIN_SWINGS
            else None
        ),
    )


def require_one_pen(calibrations: Sequence[CalibrationFile]) -> None:
    """Refuse calibrations with another pen file than the first."""
    for each in calibrations[1:]:
        if each.pen_sha256 != calibrations[0].pen_sha256:
            raise UsageError(
                "pen-health.another-pen", other=each.path, first=calibrations[0].path
            )


def _without_move(leds: FloatArray, changes: FloatArray) -> FloatArray:
    """Return changes (L, 3) without the rigid motion and scale of most LEDs."""
    known = np.isfinite(changes).all(axis=1)
    arms = leds - leds.mean(axis=0)
    A = np.concatenate(
        [np.tile(np.eye(3), (len(leds), 1, 1)), -skew(arms), arms[:, :, None]], axis=2
    )[known]
    b = changes[known]
    weights = np.ones(len(b))
    left = b
    for _ in range(ROUNDS):  # iteratively reweighted: a knocked LED must not hold it
        root = np.sqrt(weights)[:, None]
        rows = (A * root[..., None]).reshape(-1, A.shape[2])
        whole = np.linalg.lstsq(rows, (b * root).ravel())[0]
        left = b - A @ whole
        lengths = np.linalg.norm(left, axis=1)
        width = max(2 * float(np.median(lengths)), 1e-6)
        weights = 1 / (1 + (lengths / width) ** 2) ** 2
    shifts = np.full_like(changes, np.nan)
    shifts[known] = left
    return shifts


def _growth(
    first: CalibrationFile, now: CalibrationFile, camera: Camera
) -> Growth | None:
    is_other = now.camera_sha256 != first.camera_sha256
    if now is first or is_other or not _has_size(now):
        return None
    one, other = _cone_seen(first, camera), _cone_seen(now, camera)
    if one is None or other is None:
        return None
    if np.linalg.norm(one[:2] - other[:2]) > SAME_PLACE:
        return None
    own, of_first = (c.calibration.uncertainty for c in (now, first))
    deviation = np.hypot(own.distance_repeatability, of_first.distance_repeatability)
    spread = COVERAGE_FACTOR * float(deviation)
    return Growth(float(np.log(one[2] / other[2])), spread)


def _has_size(swing: CalibrationFile) -> bool:
    """Return whether its distance is from the files, whose errors then cancel."""
    return not (swing.is_of_rig or swing.calibration.adjusted.contradictions)


def _cone_seen(calibration: CalibrationFile, camera: Camera) -> FloatArray | None:
    """Return the image of the cone, px, and its depth over the focal length."""
    fitted = np.array(calibration.calibration.instrument.intrinsics)
    if len(fitted) != len(camera.intrinsics):
        return None
    seen_by = camera.with_intrinsics(fitted)
    pixel = seen_by.project(calibration.cone_cam)
    return np.append(pixel, calibration.cone_cam[2] / seen_by.fx)


def _assessment(
    swings: Sequence[SwingOfPen],
    moved: tuple[int, ...],
    growth: Growth | None,
    n_growths: int,
) -> VerificationAssessment:
    if moved:
        lengths = np.array([np.linalg.norm(each.shifts, axis=1) for each in swings])
        led = max(moved, key=lambda each: float(np.nanmax(lengths[:, each - 1])))
        when = int(np.nanargmax(lengths[:, led - 1]))
        return refused(
            message(
                "pen-health.led-moved",
                led=led,
                distance=float(lengths[when, led - 1]),
                swing=swings[when].name,
            ),
            MEASURE_AGAIN,
        )
    if growth is not None:
        # The most significant of several changes is larger by chance.
        chance = normal_quantile(BY_CHANCE / (2 * n_growths)) / COVERAGE_FACTOR
        if abs(growth.relative) > max(GROWN, chance * growth.uncertainty):
            grown = message(
                "pen-health.grown",
                growth=1e6 * growth.relative,
                uncertainty=1e6 * growth.uncertainty,
                kelvin=growth.relative / ALUMINIUM,
            )
            return check(grown, MEASURE_LENGTH)
    return accepted(
        message("pen-health.good", n_swings=len(swings)), KEEP_FILE, Grade.STEADY
    )
