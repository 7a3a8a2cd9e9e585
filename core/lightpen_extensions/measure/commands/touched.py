"""Probed points for a command: camera, pen and tip by files, then images or centres."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from lightpen.commands.arguments import add_bits, add_cameras_and_pen
from lightpen.commands.console import centers_at, lacking, progress, require_other_file
from lightpen.detection.observations import Observations, Report, observe_centers
from lightpen.errors import CalibrationError, UsageError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.opened_files import InputFile, all_hashed, hashed
from lightpen.formats.own_json import file_entry
from lightpen.formats.pen_files import read_pen
from lightpen.messages import Message
from lightpen.model.limits import BALL_UNCERTAINTY
from lightpen.model.names import Origin
from lightpen.model.pen import Pen
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen_extensions.comparisons.assessment import (
    VerificationAssessment,
    conditions_entries,
    read_drift,
    verification_record,
)
from lightpen_extensions.comparisons.commands.entering import limits_in_force
from lightpen_extensions.measure.probing.current_tip import bending_of
from lightpen_extensions.measure.probing.probing import (
    FAST,
    ONE_IMAGE,
    PRECISE,
    SETTLING,
    ProbingRules,
)
from lightpen_extensions.measure.probing.sources import (
    ImageLocation,
    PenCameras,
    ProbingRun,
    instrument_of,
    observe_place,
    read_viewers,
    recorded_runs,
    touch_place,
    touches_of,
)
from lightpen_extensions.measure.storage.session_files import (
    camera_serials,
    viewer_entries,
)
from lightpen_extensions.measure.tasks.probed_point import (
    NO_DRIFT,
    ProbedPoint,
    RejectedFrame,
    rejected_entries,
)
from lightpen_extensions.measure.tasks.task import Conditions


def add_touch_inputs(parser: argparse.ArgumentParser, tip_help: str) -> None:
    """Add the options for camera, pen, tip and images of a touch."""
    add_cameras_and_pen(
        parser,
        "give a folder that contains one folder per camera, named as in this file",
    )
    add_bits(parser)
    parser.add_argument(
        "--tip", type=Path, required=True, metavar="RESULT.json", help=tip_help
    )
    parser.add_argument(
        "--frames",
        type=int,
        choices=range(1, 101),
        metavar="N",
        help="images per probed point while the pen is held still, such as "
        f"{FAST}, or {PRECISE} for a precise point; 1: each image is a point "
        f"(default: {FAST}, or 1 if the pen was never held still)",
    )


def add_runs(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the images of runs, or their LED centres; see `given_runs`."""
    parser.add_argument(
        "runs",
        nargs="*",
        metavar="RUN",
        help=f"image folder, file name pattern, video or record: {what}",
    )
    parser.add_argument(
        "--centers",
        nargs="+",
        type=Path,
        default=(),
        metavar="FILE.csv",
        help="LED centres in place of images, a file for each RUN (frame, led, x_px, "
        "y_px)",
    )


@dataclass(frozen=True, eq=False)
class MeasuredRuns:
    """The points of all runs, and the instrument."""

    calibration: CalibrationFile
    origin: Origin  # of images or centres; simulated if some of them are
    conditions: Conditions
    runs: tuple[ProbingRun, ...]
    files: tuple[Path, ...]
    viewers: PenCameras
    pen_file: Path
    recorded: ImageLocation | None  # of a record

    @property
    def instrument(self) -> Instrument:
        """Instrument they were measured with."""
        return self.conditions.instrument

    @property
    def touches(self) -> list[tuple[str, Sequence[ProbedPoint]]]:
        """Touches of each run with its name."""
        return [(run.name, run.touches) for run in self.runs]

    @property
    def rejected(self) -> list[RejectedFrame]:
        """Images that belong to no touch."""
        return [each for run in self.runs for each in run.rejected]

    @cached_property
    def hashed_files(self) -> tuple[InputFile, ...]:
        """The images, or files of LED centres, with their hashes."""
        return all_hashed(self.files)

    @property
    def n_of_calibration(self) -> int:
        """Number of files that were used to calibrate the tip itself."""
        own = {each.sha256 for each in self.calibration.calibration.inputs.observations}
        return sum(each.sha256 in own for each in self.hashed_files)

    def record(
        self,
        options: argparse.Namespace,
        kind: str,
        entries: Mapping[str, Any],
        assessment: VerificationAssessment | None,
        rule: Message,
    ) -> dict[str, Any]:
        """Return the record of what was measured."""
        return verification_record(
            kind,
            {
                "camera_serials": camera_serials(self.instrument),
                "remarks": list(self.instrument.remarks),
                **self._conditions(),
                **entries,
                "rejected": rejected_entries(self.rejected),
            },
            assessment,
            {
                name: getattr(self.conditions.limits, name)
                for name in getattr(options, "limits", ())
            },
            self._input_entries(options),
            rule,
        )

    def _conditions(self) -> dict[str, Any]:
        """Return operator and environment as far as the images state them."""
        if self.recorded is None or self.recorded.conditions is None:
            return {}
        now = self.recorded.conditions
        return {
            "operator": self.recorded.operator,
            **conditions_entries(now.temperature_c, now.humidity_percent),
        }

    def _input_entries(self, options: argparse.Namespace) -> dict[str, Any]:
        """Return the files that were read."""
        drift: Path | None = getattr(options, "drift", None)
        plan: Path | None = getattr(options, "plan", None)
        return {
            **({} if plan is None else {"plan": file_entry(hashed(plan))}),
            "tip": file_entry(hashed(options.tip)),
            **viewer_entries(self.viewers),
            "pen": file_entry(hashed(self.pen_file)),
            "images": [file_entry(file) for file in self.hashed_files],
            **({} if drift is None else {"drift": file_entry(hashed(drift))}),
        }


def given_runs(options: argparse.Namespace, *, is_pooled: bool = False) -> MeasuredRuns:
    """Measure the given runs; if pooled, all images are those of one."""
    runs = options.runs
    places = [tuple(runs)] if is_pooled else [(run,) for run in runs]
    if bool(options.centers) == any(places):
        raise UsageError("cli.runs-or-centers")
    return measure_runs(options, places, options.centers)


def measure_runs(
    options: argparse.Namespace,
    places: Sequence[tuple[str, ...]],
    centers: Sequence[Path] = (),
) -> MeasuredRuns:
    """Measure the touches of files of LED centres, and then those at places."""
    drift: Path | None = getattr(options, "drift", None)
    inputs = options.camera, options.rig, options.pen, options.tip, drift
    require_other_file(options.json, *inputs)
    calibration = read_calibration(options.tip)
    given = read_viewers(options.camera, options.rig)
    rig = None if given is None else given.rig
    found = [touch_place(p, rig).of_bits(options.bits) for p in places if p]
    viewers = given or (found[0].viewers if found else None)
    if viewers is None:
        raise lacking("--camera or --rig")
    pen, pen_file = _pen(options, calibration, found)
    files = tuple(file for place in found for file in place.files)
    files += tuple(centers)
    require_other_file(options.json, *files)
    recorded = next((each for each in found if each.conditions), None)
    environment = None if recorded is None else recorded.conditions
    temperature_c = None if environment is None else environment.temperature_c
    bending = bending_of(calibration, getattr(options, "data", None))
    instrument = instrument_of(
        calibration, viewers, pen, pen_file, temperature_c, bending
    )
    with progress("Finding LEDs") as report:
        seen = _seen(centers, found, instrument, report)
    runs = _runs_of(seen, instrument, options.frames)
    nominal = getattr(options, "nominal_tip", None)
    for known in (pen.nominal_tip, calibration.nominal_tip):
        nominal = known if nominal is None else nominal
    limits = limits_in_force(options, calibration)
    moved = NO_DRIFT if drift is None else read_drift(drift)
    return MeasuredRuns(
        calibration=calibration,
        origin=_origin(found),
        conditions=Conditions(
            instrument=instrument,
            limits=limits,
            ball_diameter=options.ball_diameter,
            ball_uncertainty=getattr(options, "ball_uncertainty", BALL_UNCERTAINTY),
            nominal_tip=None if nominal is None else np.array(nominal, dtype=float),
            drift=moved,
        ),
        runs=tuple(runs),
        files=files,
        viewers=viewers,
        pen_file=pen_file,
        recorded=recorded,
    )


# A run: name, observations in each camera by images or centres, or points if known
SeenRun: TypeAlias = tuple[str, tuple[Observations, ...], Sequence[ProbingRun]]


def _seen(
    centers: Sequence[Path],
    places: Sequence[ImageLocation],
    instrument: Instrument,
    report: Report = lambda fraction: None,
) -> list[SeenRun]:
    if centers and instrument.rig.n_cameras > 1:
        raise UsageError("cli.centers-of-rig")
    seen: list[SeenRun] = []
    for path in centers:
        own = centers_at(path, instrument.pen)
        view = observe_centers(own, instrument.camera, instrument.pen)
        seen.append((path.name, (view,), ()))
    for i, place in enumerate(places, start=1):
        known = recorded_runs(place, instrument)
        views = () if known else observe_place(place, instrument)
        seen.append((place.name, views, known))
        report(i / len(places))
    return seen


def _runs_of(
    seen: Sequence[SeenRun], instrument: Instrument, n_frames: int | None
) -> list[ProbingRun]:
    """Return the touches of all runs.

    Unless a number of images is given, the pen was held still for the usual one; where
    it was not, each image is a touch.
    """

    def by(rules: ProbingRules) -> list[ProbingRun]:
        return [
            run
            for name, views, known in seen
            for run in known or [touches_of(name, views, instrument, rules)]
        ]

    if n_frames is not None:
        return by(ProbingRules(n_frames, SETTLING) if n_frames > 1 else ONE_IMAGE)
    try:
        return by(ProbingRules())
    except CalibrationError as error:
        if error.message.code != "verification.never-still":
            raise
    return by(ONE_IMAGE)


def _pen(
    options: argparse.Namespace,
    calibration: CalibrationFile,
    places: Sequence[ImageLocation],
) -> tuple[Pen, Path]:
    """Return the pen, with what its calibration states where its file does not."""
    if options.pen is not None:
        stated = calibration.calibration.inputs
        pen = read_pen(options.pen, stated.units, stated.led_diameter_mm, None)
        return pen, options.pen
    place = places[0] if places else None
    if place is None or place.pen is None or place.pen_file is None:
        raise lacking("--pen")
    return place.pen, place.pen_file


def _origin(places: Sequence[ImageLocation]) -> Origin:
    origins = {place.origin for place in places}
    return Origin.SIMULATED if Origin.SIMULATED in origins else Origin.RECORDED
