"""What the file of a calibration states, whole and checked: what is put on paper.

The file alone is read, an accepted result or what ``lightpen calibrate`` wrote; nothing
that a running program knows besides comes into it. Its SHA-256 binds the paper to it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from msgspec import Meta, Struct

from lightpen.detection.reasons import Reason
from lightpen.errors import UsageError
from lightpen.estimation.uncertainty import ShareName
from lightpen.estimation.verdict import Grade, NextStep
from lightpen.formats.files import printable, read_bytes
from lightpen.formats.own_json import DamagedError, Digest, Moment, Vector, in_shape
from lightpen.model.origin import Origin
from lightpen.record.calibrations import LIMIT, WHAT, record_tree
from lightpen.record.names import Names
from lightpen.record.results import Row, Since, Why, has_head, parse_result
from lightpen.sentences import sentence

Count: TypeAlias = Annotated[int, Meta(ge=0, le=10**9)]
Counts: TypeAlias = tuple[Count, Count, Count, Count, Count, Count, Count, Count]
Number: TypeAlias = float | None  # None where it could not be found
Triple: TypeAlias = tuple[Number, Number, Number]
Pair: TypeAlias = tuple[Number, Number]


class StatedProgram(Struct, frozen=True):
    """Which program calibrated."""

    name: str
    version: str


class StatedImages(Struct, frozen=True):
    """How many images there were, and why some do not take part."""

    total: Count
    used: Count
    dropped: dict[Reason, Count]


class StatedLimits(Struct, frozen=True):
    """By what the verdict was given."""

    max_uncertainty_mm: float
    min_images: Count
    min_per_field: Count


class StatedVerdict(Struct, frozen=True):
    """The verdict on the calibration by itself, with its reason in English."""

    grade: Grade
    code: str
    text: str
    next_step: NextStep
    limits: StatedLimits


class StatedShare(Struct, frozen=True):
    """A part of the uncertainty: k = 1 along the axes, U (k = 2) where it is most."""

    name: ShareName
    standard_uncertainty_mm: Vector
    weakest_expanded_uncertainty_mm: float
    assumed: bool


class StatedUncertainty(Struct, frozen=True):
    """What U is made of, and what odd and even images say of it."""

    shares: tuple[StatedShare, ...]
    correlation_factor: float
    halves_difference_mm: Triple
    halves_expanded_uncertainty_mm: Triple


class StatedDirection(Struct, frozen=True):
    """Along which direction of the pen the tip is known least."""

    vector_pen: Vector
    expanded_uncertainty_mm: float


class StatedCoverage(Struct, frozen=True):
    """Which postures the swing held, by the directions of the dial."""

    leaning: Counts
    leaning_far: Counts
    upright: Count
    tilt_deg: tuple[float, float]
    turn_deg: tuple[float, float]


class StatedLed(Struct, frozen=True):
    """What the images say of an LED."""

    led: Count
    seen: Count
    used: Count
    rms_px: Number
    mean_px: Pair
    displacement_mm: Triple
    displaced: bool


class StatedParameter(Struct, frozen=True):
    """A parameter of the camera as the images have it."""

    value: float
    standard_uncertainty: float


class StatedAdjustment(Struct, frozen=True):
    """What the images made of the files."""

    intrinsics: dict[str, StatedParameter]
    disc_diameter_mm: float
    pen_growth: float


class StatedInstrument(Struct, frozen=True):
    """Camera and pen as the images have them."""

    intrinsics: Annotated[tuple[float, ...], Meta(min_length=4)]
    disc_diameter_mm: Annotated[float, Meta(gt=0, le=1000)]
    leds_mm: tuple[Vector, ...]


class StatedFile(Struct, frozen=True):
    """A file that was read."""

    file: str
    sha256: Digest


class StatedInputs(Struct, frozen=True):
    """All files that were read."""

    camera: StatedFile
    pen: StatedFile
    observations: tuple[StatedFile, ...]
    rig: StatedFile | None = None
    cameras: tuple[StatedFile, ...] = ()


class StatedSpot(Struct, frozen=True):
    """The centre of an LED in an image."""

    led: Annotated[int, Meta(ge=1)]
    x_px: float
    y_px: float
    used: bool


class StatedImage(Struct, frozen=True):
    """What became of an image."""

    file: str
    used: bool
    reason: Reason
    rms_px: Number
    tip_cam_mm: Triple
    leds: tuple[StatedSpot, ...]
    camera: str = ""


class StatedCalibration(Struct, frozen=True):
    """The record of a calibration; README.md documents its entries."""

    program: StatedProgram
    created: Moment
    method: str
    tip_pen_mm: Vector
    cone_cam_mm: Vector
    covariance: tuple[Row, Row, Row, Row, Row, Row]
    expanded_uncertainty_mm: Vector
    cone_expanded_uncertainty_mm: Vector
    rms_px: float
    rms_mm: float
    sigma_px: float
    images: StatedImages
    verdict: StatedVerdict
    warnings: tuple[Why, ...]
    uncertainty: StatedUncertainty
    weakest_direction: StatedDirection
    coverage: StatedCoverage
    leds: tuple[StatedLed, ...]
    adjusted: StatedAdjustment
    assumptions: dict[str, Number]
    inputs: StatedInputs
    frames: tuple[StatedImage, ...]
    instrument: StatedInstrument | None = None
    origin: Origin | None = None
    nominal_tip_mm: Vector | None = None
    change_from_nominal_mm: Vector | None = None
    rig: Any = None
    second_cone: Any = None

    def __post_init__(self) -> None:
        n_leds = len(self.leds)
        seen = (spot.led for image in self.frames for spot in image.leds)
        if max(seen, default=0) > n_leds:
            raise ValueError("An LED is seen that the pen does not have.")
        if self.instrument is not None and len(self.instrument.leds_mm) != n_leds:
            raise ValueError("The instrument is of another pen.")


@dataclass(frozen=True)
class Entered:
    """Where in an archive a calibration is entered.

    Attributes
    ----------
    number : int
        In its chain, from 1.
    sha256, previous : str
        Of the entry, and of the one before it.
    """

    number: int
    sha256: str
    previous: str


@dataclass(frozen=True)
class Statement:
    """A calibration as its file states it.

    Attributes
    ----------
    file : str
        Name of the file.
    sha256 : str
        Of the whole file.
    names : Names
        Empty of a record that nobody accepted.
    accepted : datetime or None
        None of such a record, too.
    grade : Grade
        Verdict on it when it was accepted, else by itself.
    origin : Origin or None
        None where it does not say.
    why : Why
        What the grade is for.
    reason : str
        Why it was accepted though it was to be checked, or put in force again, in the
        words of who did.
    doubts : tuple of Why
        What else there was to look into.
    change : Since or None
        Since the tip that was in force before.
    restores : str or None
        Hash of the entry of the archive whose tip is in force again by it.
    is_checked : bool
        Whether a change of the file would have been noticed.
    """

    file: str
    sha256: str
    names: Names
    accepted: datetime | None
    grade: Grade
    origin: Origin | None
    why: Why
    reason: str
    doubts: tuple[Why, ...]
    change: Since | None
    restores: str | None
    is_checked: bool
    calibration: StatedCalibration

    @property
    def when(self) -> datetime:
        """When it was accepted, or else computed."""
        return self.accepted or self.calibration.created


def read_statement(path: Path) -> Statement:
    """Return what the file of a calibration states.

    Raises
    ------
    FileError
        It cannot be read, or is not as it was written.
    UsageError
        It holds no calibration, or not all that is put on paper.
    """
    data = read_bytes(path, WHAT, LIMIT)
    file, digest = printable(path.name), sha256(data).hexdigest()
    if has_head(data):
        result = parse_result(data, path, Path)
        calibration = _calibration(result.calibration, path)
        verdict = calibration.verdict
        return Statement(
            *(file, digest, result.names, result.accepted),
            grade=_grade(result.grade, path),
            origin=result.origin,
            why=result.why or Why(verdict.code, verdict.text),
            reason=result.reason,
            doubts=result.doubts,
            change=result.change,
            restores=result.restores,
            is_checked=True,
            calibration=calibration,
        )
    tree, is_checked = record_tree(data, path)
    calibration = _calibration(tree, path)
    verdict = calibration.verdict
    return Statement(
        *(file, digest, Names(), None, verdict.grade, calibration.origin),
        why=Why(verdict.code, verdict.text),
        reason="",
        doubts=tuple(w for w in calibration.warnings if w.code != verdict.code),
        change=None,
        restores=None,
        is_checked=is_checked,
        calibration=calibration,
    )


def _calibration(tree: Mapping[str, Any], path: Path) -> StatedCalibration:
    try:
        return in_shape(tree, StatedCalibration)
    except DamagedError as error:
        raise _not_enough(path) from error


def _grade(text: str, path: Path) -> Grade:
    try:
        return Grade(text)
    except ValueError as error:
        raise _not_enough(path) from error


def _not_enough(path: Path) -> UsageError:
    return UsageError(
        sentence(
            "statement.not-enough",
            "{path} does not hold all that is put on paper: it is no calibration, or "
            "one by an earlier version of the program. Give an accepted result or what "
            "the command calibrate wrote, or calibrate again from the images.",
            path=printable(str(path)),
        )
    )
