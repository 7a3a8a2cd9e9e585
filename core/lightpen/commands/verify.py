"""``lightpen verify``: verify a tip on reference artefacts."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lightpen.commands.arguments import (
    above_zero,
    add_json,
    add_limits,
    add_pen_options,
    add_verdict,
    chosen_limits,
    finite,
    limits_by,
    not_negative,
)
from lightpen.commands.console import (
    lacking,
    printing,
    progress,
    require_other_file,
    shown,
    verdict_status,
    write_record,
)
from lightpen.commands.entering import add_entering, keep_record
from lightpen.commands.pen_health import add_verify_pen
from lightpen.detection.observations import Observations, observe_centers
from lightpen.errors import CalibrationError, UsageError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.hashes import all_hashed, hashed
from lightpen.formats.json_records import file_entry
from lightpen.formats.observation_files import read_centers
from lightpen.formats.pen_files import read_pen
from lightpen.model.limits import rule_in_words
from lightpen.model.origin import Origin
from lightpen.model.pen import Pen
from lightpen.record.calibrations.calibrations import CalibrationFile, read_calibration
from lightpen.verification.history.recorded_tasks import read_drift
from lightpen.verification.probing.current_tip import cone_before
from lightpen.verification.probing.drift_reference import (
    LampDrift,
    judged_with,
    lamp_drift_entries,
)
from lightpen.verification.probing.image_locations import (
    ImageLocation,
    PenCameras,
    read_viewers,
    touch_place,
)
from lightpen.verification.probing.probing import (
    FAST,
    ONE_IMAGE,
    PRECISE,
    SETTLING,
    ProbingRules,
)
from lightpen.verification.probing.sources import (
    ProbingRun,
    instrument_of,
    lamp_drift_of,
    observe_place,
    touches_of,
)
from lightpen.verification.reports.records import verification_record
from lightpen.verification.reports.summaries import found_text, touches_text
from lightpen.verification.storage.verification_files import viewer_entries
from lightpen.verification.tasks.assessment import VerificationAssessment
from lightpen.verification.tasks.probed_point import (
    NO_DRIFT,
    ProbedPoint,
    RejectedFrame,
    on_surface,
    point_entries,
    rejected_entries,
)
from lightpen.verification.tasks.registry import TASKS, AnyTask
from lightpen.verification.tasks.task import (
    Conditions,
    NumberOption,
    SurfaceOption,
    TaskOptions,
)


def add_verify(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen verify`` and its tasks."""
    kinds = parser.add_subparsers(required=True, metavar="WHAT")
    for task in TASKS:
        _add_task(kinds.add_parser(task.command, help=task.summary), task)
    _add_touches(
        kinds.add_parser("touches", help="probed points with uncertainty; no verdict")
    )
    add_verify_pen(kinds.add_parser("pen", help="LED stability over several swings"))


def _add_task(parser: argparse.ArgumentParser, task: AnyTask) -> None:
    parser.set_defaults(run=_verify_task, task=task, ball_diameter=None)
    _add_runs(parser, task.run_help)
    for option in task.fields:
        match option:
            case NumberOption(argument=str() as argument) if argument:
                is_needed = option.unknown is not None and not option.is_optional
                parser.add_argument(
                    argument,
                    dest=option.name,
                    type=above_zero if is_needed else not_negative,
                    required=is_needed,
                    default=0.0,
                    metavar="MM",
                    help=option.help,
                )
            case SurfaceOption():
                _add_ball(parser, option.ball_help)
                parser.add_argument(
                    option.argument,
                    dest=option.name,
                    choices=tuple(option.words),
                    default=next(iter(option.words)),
                )
    if task.compares_nominal_tip:
        parser.add_argument(
            "--nominal-tip", type=finite, nargs=3, metavar=("X", "Y", "Z"), help="mm"
        )
    if task.counts_drift:
        parser.add_argument(
            "--drift",
            type=Path,
            metavar="DRIFT.json",
            help="record of verify drift of the same session, included in U",
        )
    _add_common(parser, *task.limits)
    add_verdict(parser)
    add_entering(parser)


def _add_ball(parser: argparse.ArgumentParser, what: str) -> None:
    parser.add_argument("--ball-diameter", type=above_zero, metavar="MM", help=what)
    parser.add_argument(
        "--ball-uncertainty",
        type=not_negative,
        default=0.0,
        metavar="MM",
        help="U (k = 2) of the diameter of the ball",
    )


def _add_touches(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_touches, decision_rule="simple", max_risk=5.0)
    _add_runs(parser, "points that were touched")
    _add_ball(
        parser, "of the probe, to give the surface that it touched, not its centre"
    )
    parser.add_argument(
        "--along",
        choices=("approach", "axis"),
        default="approach",
        help=(
            "direction from the ball centre to the surface: approach direction if "
            "the images show it, else the pen axis; or always the pen axis"
        ),
    )
    _add_common(parser)


def _add_runs(parser: argparse.ArgumentParser, what: str) -> None:
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


def _add_common(parser: argparse.ArgumentParser, *limits: str) -> None:
    parser.add_argument("--camera", type=Path, metavar="FILE")
    parser.add_argument(
        "--rig",
        type=Path,
        metavar="FILE",
        help=(
            "rig file with the extrinsics of several cameras, instead of --camera; "
            "give a folder that contains one folder per camera, named as in this "
            "file"
        ),
    )
    parser.add_argument("--pen", type=Path, metavar="FILE")
    add_pen_options(parser)
    parser.add_argument(
        "--tip",
        type=Path,
        required=True,
        metavar="RESULT.json",
        help="calibration to verify",
    )
    parser.add_argument(
        "--frames",
        type=int,
        choices=range(1, 101),
        metavar="N",
        help="images of a touch, through which the pen is held still, such as "
        f"{FAST} or for a precise one {PRECISE}; 1 takes each image for a touch. "
        f"Unless said {FAST}, or 1 where the pen was held still for none",
    )
    add_limits(parser, *limits)
    add_json(parser)


@dataclass(frozen=True, eq=False)
class _Measured:
    """The points of all runs, and what they were measured with.

    Attributes
    ----------
    origin : Origin
        Of the images or centres; simulated if some of them are.
    lamp_drift : LampDrift or None
        The drift of fixed lamps in view.
    """

    calibration: CalibrationFile
    origin: Origin
    conditions: Conditions
    runs: tuple[ProbingRun, ...]
    files: tuple[Path, ...]
    viewers: PenCameras
    pen_file: Path
    lamp_drift: LampDrift | None

    @property
    def instrument(self) -> Instrument:
        return self.conditions.instrument

    @property
    def touches(self) -> list[tuple[str, Sequence[ProbedPoint]]]:
        return [(run.name, run.touches) for run in self.runs]

    @property
    def rejected(self) -> list[RejectedFrame]:
        return [each for run in self.runs for each in run.rejected]


@printing
def _verify_task(given: argparse.Namespace) -> int:
    task: AnyTask = given.task
    runs = [tuple(given.runs)] if task.is_pooled else [(run,) for run in given.runs]
    measured = _measure(given, runs)
    conditions = measured.conditions
    found = task.measure(measured.touches, conditions, _task_options(task, given))
    judged = judged_with(found.assessment, measured.lamp_drift)
    rule = rule_in_words(conditions.limits)
    tables = task.tables(found, conditions)
    print(shown(found_text(tables, judged, measured.rejected, rule)))
    _print_lamp_drift(measured, judged)
    entries = task.entries(found, measured.instrument)
    record = _record(given, measured, task.kind, entries, judged)
    keep_record(given, record, measured.calibration, measured.origin)
    return verdict_status(given, judged.grade)


def _task_options(task: AnyTask, given: argparse.Namespace) -> TaskOptions:
    """Return the options of a task; without a ball, its centre runs in a groove."""
    values = {}
    for option in task.fields:
        match option:
            case NumberOption() if option.argument:
                values[option.name] = getattr(given, option.name)
            case SurfaceOption() if given.ball_diameter:
                values[option.name] = option.words[getattr(given, option.name)]
    options: TaskOptions = task.options(**values)
    return options


@printing
def _touches(options: argparse.Namespace) -> None:
    measured = _measure(options, [(run,) for run in options.runs])
    touches = [touch for run in measured.runs for touch in run.touches]
    if options.ball_diameter is not None:
        if options.along == "axis":
            touches = [replace(touch, approach_cam=None) for touch in touches]
        radius = options.ball_diameter / 2
        touches = [on_surface(touch, radius) for touch in touches]
    print(shown(touches_text(touches, measured.instrument, measured.rejected)))
    _print_lamp_drift(measured)
    if options.json is not None:
        entries = {"touches": point_entries(touches, measured.instrument)}
        write_record(options.json, _record(options, measured, "touches", entries, None))


def _measure(
    options: argparse.Namespace, places: Sequence[tuple[str, ...]]
) -> _Measured:
    drift: Path | None = getattr(options, "drift", None)
    inputs = options.camera, options.rig, options.pen, options.tip, drift
    require_other_file(options.json, *inputs)
    calibration = read_calibration(options.tip)
    given = read_viewers(options.camera, options.rig)
    rig = None if given is None else given.rig
    if bool(options.centers) == any(places):
        raise UsageError("cli.runs-or-centers")
    found = [touch_place(each, rig) for each in places if each]
    viewers = given or (found[0].viewers if found else None)
    if viewers is None:
        raise lacking("--camera or --rig")
    pen, pen_file = _pen(options, found)
    files = tuple(file for place in found for file in place.files)
    files += tuple(options.centers)
    require_other_file(options.json, *files)
    instrument = instrument_of(calibration, viewers, pen, pen_file)
    seen = _seen(options, found, instrument)
    runs = _runs_of(seen, instrument, options.frames)
    nominal = getattr(options, "nominal_tip", None)
    for known in (pen.nominal_tip, calibration.nominal_tip):
        nominal = known if nominal is None else nominal
    limits = limits_by(options)
    lamp_drift = lamp_drift_of(runs, instrument, limits)
    moved = NO_DRIFT if drift is None else read_drift(drift)
    return _Measured(
        calibration=calibration,
        origin=_origin(found),
        conditions=Conditions(
            instrument=instrument,
            limits=limits,
            ball_diameter=options.ball_diameter,
            ball_uncertainty=getattr(options, "ball_uncertainty", 0.0),
            nominal_tip=None if nominal is None else np.array(nominal, dtype=float),
            cone_cam=cone_before(calibration, viewers),
            drift=moved if lamp_drift is None else np.maximum(moved, lamp_drift.share),
        ),
        runs=tuple(runs),
        files=files,
        viewers=viewers,
        pen_file=pen_file,
        lamp_drift=lamp_drift,
    )


@dataclass(frozen=True, eq=False)
class _SeenRun:
    """What the images of a run, or its centres, show in each camera."""

    name: str
    views: tuple[Observations, ...]
    touches: tuple[int, ...] | None = None


def _seen(
    options: argparse.Namespace, places: Sequence[ImageLocation], instrument: Instrument
) -> list[_SeenRun]:
    if options.centers and instrument.rig.n_cameras > 1:
        raise UsageError("cli.centers-of-rig")
    seen = []
    for path in options.centers:
        centers = read_centers(path, instrument.pen.n_leds)
        view = observe_centers(centers, instrument.camera, instrument.pen)
        seen.append(_SeenRun(path.name, (view,)))
    with progress("Finding LEDs") as report:
        for i, place in enumerate(places, start=1):
            views = observe_place(place, instrument)
            seen.append(_SeenRun(place.name, views, place.touches))
            report(i / len(places))
    return seen


def _runs_of(
    seen: Sequence[_SeenRun], instrument: Instrument, n_frames: int | None
) -> list[ProbingRun]:
    """Return the touches of all runs.

    Unless a number of images is given, the pen was held still for the usual one; where
    it was not, each image is a touch.
    """

    def by(rules: ProbingRules) -> list[ProbingRun]:
        return [
            touches_of(run.name, run.views, instrument, rules, run.touches)
            for run in seen
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
    options: argparse.Namespace, places: Sequence[ImageLocation]
) -> tuple[Pen, Path]:
    if options.pen is not None:
        pen = read_pen(options.pen, options.units, options.led_diameter, None)
        return pen, options.pen
    place = places[0] if places else None
    if place is None or place.pen is None or place.pen_file is None:
        raise lacking("--pen")
    return place.pen, place.pen_file


def _origin(places: Sequence[ImageLocation]) -> Origin:
    origins = {place.origin for place in places}
    return Origin.SIMULATED if Origin.SIMULATED in origins else Origin.RECORDED


def _print_lamp_drift(
    measured: _Measured, judged: VerificationAssessment | None = None
) -> None:
    """Print the drift of fixed lamps, unless it is the verdict."""
    told = None if measured.lamp_drift is None else measured.lamp_drift.assessment
    if told is not None and told is not judged:
        print(shown(str(told.reason)))


def _record(
    options: argparse.Namespace,
    measured: _Measured,
    kind: str,
    entries: Mapping[str, Any],
    assessment: VerificationAssessment | None,
) -> dict[str, Any]:
    drift: Path | None = getattr(options, "drift", None)
    return verification_record(
        kind,
        {
            **entries,
            "rejected": rejected_entries(measured.rejected),
            "witness": lamp_drift_entries(measured.lamp_drift),
        },
        assessment,
        chosen_limits(options),
        {
            "tip": file_entry(hashed(options.tip)),
            **viewer_entries(measured.viewers),
            "pen": file_entry(hashed(measured.pen_file)),
            "images": [file_entry(file) for file in all_hashed(measured.files)],
            **({} if drift is None else {"drift": file_entry(hashed(drift))}),
        },
        rule_in_words(measured.conditions.limits),
    )
