"""The LEDs of a pen over its swings: whether one was knocked.

Each calibration gives the displacement of each LED from its place in the file, except
a move of the whole pen and, with one camera, its scale. What changed from the first
swing on is stated by LED after the best move and scale of all are removed.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError, FileError, UsageError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.opened_files import hashed
from lightpen.messages import message
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
    refused,
)

MIN_SWINGS = 2
MOST = 20  # swings of a pen that are read, the newest
MOVED = 0.02  # mm, from which on an LED has moved
STANDS_OUT = 5.0  # times the median change of all LEDs
ROUNDS = 20
MEASURE_AGAIN = message("pen-health.measure-again")
KEEP_FILE = message("pen-health.keep-file")


@dataclass(frozen=True, eq=False)
class SwingOfPen:
    """The state of a pen by one swing, relative to the first."""

    name: str
    shifts: FloatArray  # (L, 3), of LEDs since the first swing, mm; NaN if not seen


@dataclass(frozen=True, eq=False)
class PenHealth:
    """A pen over its swings."""

    swings: tuple[SwingOfPen, ...]
    moved: tuple[int, ...]  # numbers of the LEDs that moved, from 1
    assessment: VerificationAssessment


def examine_pen(calibrations: Sequence[CalibrationFile], leds: FloatArray) -> PenHealth:
    """Examine a pen by at least two calibrations, the oldest first.

    ``leds`` (L, 3), mm, are the LEDs of the pen file. Raises `UsageError` for different
    pens.
    """
    require_one_pen(calibrations)
    if len(calibrations) < MIN_SWINGS:
        raise CalibrationError("pen-health.too-few")
    first = calibrations[0]
    swings = [
        SwingOfPen(
            name=each.path.name,
            shifts=_without_move(leds, each.displacements - first.displacements),
        )
        for each in calibrations
    ]
    lengths = np.array([np.linalg.norm(each.shifts, axis=1) for each in swings])
    usual = np.nanmedian(lengths[1:], axis=1, keepdims=True)
    stands_out = np.nan_to_num(lengths[1:]) > np.maximum(STANDS_OUT * usual, MOVED)
    moved = tuple((np.flatnonzero(stands_out.any(axis=0)) + 1).tolist())
    return PenHealth(tuple(swings), moved, _assessment(swings, moved))


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
    pen_file = preparation.pen_file
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
    return PenOverTime(
        names=names,
        is_simulated=is_simulated,
        pen=pen_file.pen,
        pen_sha256=pen_sha256,
        swings=swings,
        n_left_out=len(files) - len(swings),
        health=(
            examine_pen(swings, pen_file.pen.leds)
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


def _assessment(
    swings: Sequence[SwingOfPen], moved: tuple[int, ...]
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
    return accepted(
        message("pen-health.good", n_swings=len(swings)), KEEP_FILE, Grade.STEADY
    )
