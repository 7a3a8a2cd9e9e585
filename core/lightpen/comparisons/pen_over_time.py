"""A pen over its swings: shifts of its LEDs, and bending by a press test."""

from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from datetime import date, datetime
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.comparisons.assessment import (
    BY_CHANCE,
    VerificationAssessment,
    accepted,
    check,
)
from lightpen.comparisons.led_file import ImprovedPen, fit_held, improve_pen
from lightpen.comparisons.pen_health import MIN_SWINGS, PenHealth, examine_pen
from lightpen.errors import FileError, UsageError
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.contact.joint import JointFit
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.opened_files import hashed
from lightpen.formats.pen_files import write_pen
from lightpen.formats.rig_files import write_camera
from lightpen.messages import Message, message
from lightpen.model.bending import ASSUMED, MeasuredBending, measured_on
from lightpen.model.coverage import COVERAGE_FACTOR, chi_square_quantile
from lightpen.model.names import Origin
from lightpen.model.pen import Pen
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen.record.library.entered_files import make_folder
from lightpen.record.results.result_folder import SIMULATED, FolderArchive
from lightpen.record.swings.header import Names, folder_name
from lightpen.swing.preparation import Preparation

LED_FILES = "led files"  # a folder of the data folder
MOST = 20  # swings, the newest
MOST_POOLED = 8  # more add little, and each is solved again

Tell = Callable[[float], None]


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


@dataclass(frozen=True, eq=False)
class NewLedFile:
    """An improved LED file, the camera file of the same swings, and their content."""

    path: Path
    camera_path: Path
    improved: ImprovedPen


def read_pen_over_time(
    archive: FolderArchive, preparation: Preparation, report: Tell = lambda _: None
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


def adjust_together(
    archive: FolderArchive,
    preparation: Preparation,
    chosen: Collection[Path],
    now: datetime,
    report: Tell = lambda _: None,
) -> NewLedFile:
    """Write LED file and camera file by the accepted swings with the chosen results.

    Results with other files take no part; see `led_file.improve_pen`. The old file
    stays, and no file is replaced.
    """
    pen = read_pen_over_time(archive, preparation)
    if preparation.camera_file is None:
        raise ValueError("The camera of the swings must be chosen.")
    camera_sha256 = hashed(preparation.camera_file.path).sha256
    swings = [
        swing
        for swing in pen.swings
        if swing.path in chosen
        and swing.camera_sha256 == camera_sha256
        and not swing.is_of_rig
    ]
    camera = preparation.camera_file.camera
    improved = improve_pen(
        swings[-MOST_POOLED:], camera, pen.pen, report=report, must_gain=False
    )
    data = archive.folder
    folder = (data / SIMULATED if pen.is_simulated else data) / LED_FILES
    make_folder(folder)
    stem = folder_name(Names(pen=pen.names.pen), now)
    names = (f"{stem}{'' if n == 1 else f'-{n}'}.json" for n in count(1))
    path = next(folder / name for name in names if not (folder / name).exists())
    write_pen(improved.pen, path, pen.pen_sha256)
    camera_path = path.with_suffix(".yaml")
    write_camera(improved.camera, camera_path)
    return NewLedFile(path, camera_path, improved)


# Press test: the effective tip of a firm swing less that of a light one.
#
# Same tip, cone, pen and camera. A stylus, ball thread or seat that gives way across
# the pen in proportion to the lean moves the effective tip along the pen. Both swings
# are fitted with one instrument held fixed, first that of one swing, then that of the
# other, and the differences of the tips are averaged: errors of camera, LEDs and scale
# cancel. The rest, due to different postures, is about as large as the disagreement of
# the two differences.


PRESS_TEST = "press"  # kind of its record
ALONG_PEN = 1  # axis of the pen frame
RESOLVED = 0.02  # mm, U of the bending above which the test shows little
STIFFEN = message("press-test.stiffen")
KEEP = message("press-test.keep")
MORE_IMAGES = message("press-test.more-images")


@dataclass(frozen=True, eq=False)
class PressTest:
    """Change of the effective tip by firm pressure."""

    change: FloatArray  # (3,), pen frame, firm less light, mm
    uncertainty: FloatArray  # (3,), U (k = 2), mm
    assessment: VerificationAssessment

    @property
    def words(self) -> tuple[Message, Message]:
        """Verdict and next step."""
        return self.assessment.reason, self.assessment.next_step

    @property
    def entries(self) -> dict[str, Any]:
        """Entries of a record."""
        return {
            "tip_change_mm": self.change,
            "tip_change_expanded_uncertainty_mm": self.uncertainty,
        }

    def bending(self, day: date) -> MeasuredBending | None:
        """Return the bending by a test of a day; None if it is too coarse to count."""
        if self.uncertainty[ALONG_PEN] > RESOLVED:
            return None
        change, uncertainty = self.change[ALONG_PEN], self.uncertainty[ALONG_PEN]
        return measured_on(day, float(change), float(uncertainty))


def press_test(light: Calibration, firm: Calibration) -> PressTest:
    """Compare a swing with firm pressure with a light one.

    Raises `UsageError` if they are of different cameras or LEDs, and `CalibrationError`
    if the images of one do not fit the instrument of the other.
    """
    one, other = light.instrument, firm.instrument
    if one.rig.n_cameras != other.rig.n_cameras or one.pen.n_leds != other.pen.n_leds:
        raise UsageError("press-test.another-station")
    (first, noise), (second, _) = (
        _difference(light, firm, each) for each in (one, other)
    )
    uneven = 0.5 * (second - first)
    variances = noise + uneven**2
    change, uncertainty = 0.5 * (first + second), COVERAGE_FACTOR * np.sqrt(variances)
    found = float(change[ALONG_PEN]), float(uncertainty[ALONG_PEN])
    return PressTest(change, uncertainty, _assessment(*found))


def _difference(
    light: Calibration, firm: Calibration, instrument: Instrument
) -> tuple[FloatArray, FloatArray]:
    """Return the tip of the firm swing less that of the light one, and variances."""
    fits = [fit_held(each, instrument.rig, instrument.pen) for each in (light, firm)]
    before, after = (fit.tip_pen for fit in fits)
    scatter = _scatter(fits[0]) + _scatter(fits[1])
    return after - before, np.diag(scatter)[:3]


def _scatter(fit: JointFit) -> FloatArray:
    """Return the covariance by noise, or by the scatter of the images if larger.

    With seat and jitter in them, the images scatter by more than their noise.
    """
    scores = fit.gradients - fit.gradients.mean(axis=0)
    n_images, noise = len(scores), fit.covariance
    scatter = scores.T @ scores * n_images / (n_images - 1)
    is_larger = float(np.trace(noise @ scatter)) > len(noise)
    return np.asarray(noise @ scatter @ noise) if is_larger else noise


def _assessment(bending: float, uncertainty: float) -> VerificationAssessment:
    if uncertainty > RESOLVED:
        return check(message("press-test.coarse", uncertainty=uncertainty), MORE_IMAGES)
    sigma = uncertainty / COVERAGE_FACTOR
    is_bent = bending**2 > chi_square_quantile(1, BY_CHANCE) * sigma**2
    shown = abs(bending)
    if is_bent and abs(bending) > ASSUMED:
        said = message("press-test.gives-way", bending=shown, uncertainty=uncertainty)
        return check(said, STIFFEN)
    said = message("press-test.steady", bending=shown, uncertainty=uncertainty)
    return accepted(said, KEEP, Grade.STEADY)
