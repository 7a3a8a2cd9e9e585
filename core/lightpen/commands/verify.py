"""``lightpen verify``: prove a tip by touching what is known."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.commands.arguments import (
    above_zero,
    add_json,
    add_pen_options,
    finite,
    not_negative,
)
from lightpen.commands.console import (
    lacking,
    printing,
    progress,
    require_other_file,
    shown,
    write_record,
)
from lightpen.commands.pen_health import add_verify_pen
from lightpen.estimation.instrument import Instrument
from lightpen.formats.hashes import all_hashed, hashed
from lightpen.formats.json_records import file_entry
from lightpen.formats.pen_files import read_pen
from lightpen.model.limits import VerificationLimits
from lightpen.model.pen import Pen
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen.verification.articulation import (
    by_posture,
    measure_articulation,
)
from lightpen.verification.assessment import Conformity
from lightpen.verification.circle import measure_circle
from lightpen.verification.drift import measure_drift
from lightpen.verification.fixed_point import measure_fixed_point
from lightpen.verification.keeping import viewer_entries
from lightpen.verification.length import measure_length
from lightpen.verification.places import (
    TouchPlace,
    Viewers,
    read_viewers,
    touch_place,
)
from lightpen.verification.read_back import read_drift
from lightpen.verification.records import (
    articulation_entries,
    circle_entries,
    drift_entries,
    fixed_point_entries,
    length_entries,
    rejected_entries,
    touch_entries,
    verification_record,
)
from lightpen.verification.sources import (
    TouchRun,
    instrument_of,
    touch_run,
    witness_of,
)
from lightpen.verification.texts import (
    articulation_text,
    circle_text,
    drift_text,
    fixed_point_text,
    length_text,
    touches_text,
)
from lightpen.verification.tip_in_force import cone_before
from lightpen.verification.touch import NO_DRIFT, Touch, on_surface
from lightpen.verification.touching import FAST, PRECISE, SETTLING, TouchRules
from lightpen.verification.witness import LampWitness, judged_with, witness_entries


def add_verify(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen verify`` and what it verifies."""
    kinds = parser.add_subparsers(required=True, metavar="WHAT")
    _add_fixed_point(
        kinds.add_parser("fixed-point", help="the cone again, in new postures")
    )
    _add_circle(kinds.add_parser("circle", help="a ring of certified radius"))
    _add_length(kinds.add_parser("length", help="a certified length"))
    _add_articulation(
        kinds.add_parser("articulation", help="one point, in the form of ISO 10360-12")
    )
    _add_drift(kinds.add_parser("drift", help="whether the camera moved meanwhile"))
    _add_touches(
        kinds.add_parser(
            "touches", help="points, each with its uncertainty; no verdict"
        )
    )
    add_verify_pen(kinds.add_parser("pen", help="the LEDs over several swings"))


def _add_fixed_point(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_fixed_point)
    parser.add_argument(
        "images",
        nargs="+",
        metavar="IMAGES",
        help="a folder, a pattern, a video, or the record of a swing",
    )
    parser.add_argument(
        "--nominal-tip", type=finite, nargs=3, metavar=("X", "Y", "Z"), help="mm"
    )
    _add_drift_share(parser)
    _add_common(parser, "across", "along")


def _add_circle(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_circle)
    _add_runs(parser, "once round the ring")
    _add_certified(parser, "--radius")
    parser.add_argument(
        "--ball-diameter",
        type=above_zero,
        metavar="MM",
        help="of the probe, where it touched a bore or a boss and not a groove",
    )
    parser.add_argument("--surface", choices=("bore", "boss"), default="bore")
    _add_drift_share(parser)
    _add_common(parser, "radius", "form")


def _add_length(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_length)
    _add_runs(parser, "both ends of the length at one place")
    _add_certified(parser, "--length")
    parser.add_argument(
        "--ball-diameter",
        type=above_zero,
        metavar="MM",
        help="of the probe, where it touched faces and not cones",
    )
    parser.add_argument("--faces", choices=("inner", "outer"), default="outer")
    _add_drift_share(parser)
    _add_common(parser, "length")


def _add_articulation(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_articulation)
    _add_runs(
        parser, "one posture; a single run holds five postures, one after the other"
    )
    _add_common(parser, "location")


def _add_drift(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_drift)
    _add_runs(parser, "one visit of a cone that stands still, in order of time")
    _add_common(parser, "drift")


def _add_touches(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_touches)
    _add_runs(parser, "points that were touched")
    parser.add_argument(
        "--ball-diameter",
        type=above_zero,
        metavar="MM",
        help="of the probe, to give the surface that it touched, not its centre",
    )
    parser.add_argument(
        "--along",
        choices=("approach", "axis"),
        default="approach",
        help="where the surface lies from the centre: the way that the tip came, where "
        "the images show it and else along the axis of the pen; or always the axis",
    )
    _add_common(parser)


def _add_runs(parser: argparse.ArgumentParser, what: str) -> None:
    parser.add_argument(
        "runs",
        nargs="+",
        metavar="RUN",
        help=f"a folder, a pattern, a video or a record: {what}",
    )


def _add_certified(parser: argparse.ArgumentParser, option: str) -> None:
    parser.add_argument(
        option, type=above_zero, required=True, metavar="MM", help="certified"
    )
    parser.add_argument(
        "--certified-uncertainty",
        type=not_negative,
        default=0.0,
        metavar="MM",
        help="U (k = 2) of what is certified",
    )


def _add_drift_share(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--drift",
        type=Path,
        metavar="DRIFT.json",
        help="what verify drift wrote of the same session: U counts it",
    )


def _add_common(parser: argparse.ArgumentParser, *limits: str) -> None:
    parser.add_argument("--camera", type=Path, metavar="FILE")
    parser.add_argument(
        "--rig",
        type=Path,
        metavar="FILE",
        help="several cameras and where they stand, in place of --camera; what is "
        "given is then a folder that holds one for each camera, named as in this file",
    )
    parser.add_argument("--pen", type=Path, metavar="FILE")
    add_pen_options(parser)
    parser.add_argument(
        "--tip",
        type=Path,
        required=True,
        metavar="RESULT.json",
        help="the calibration to verify",
    )
    parser.add_argument(
        "--frames",
        type=int,
        choices=range(1, 101),
        default=1,
        metavar="N",
        help="images of a touch, through which the pen is held still, such as "
        f"{FAST} or for a precise one {PRECISE}; 1 unless said: each image is a touch",
    )
    usual = VerificationLimits()
    for name in limits:
        parser.add_argument(
            f"--limit-{name}",
            type=above_zero,
            default=getattr(usual, name),
            metavar="MM",
            help=f"{getattr(usual, name):g} unless said",
        )
    add_json(parser)


@dataclass(frozen=True, eq=False)
class _Measured:
    """The touches of all runs, and what they were measured with.

    Attributes
    ----------
    cone_cam : (3,) array or None
        Of the calibration; None before another camera.
    drift : (3,) array
        Standard uncertainty of a point by a camera that moved meanwhile, mm.
    witness : LampWitness or None
        What fixed lamps in view tell of the camera.
    """

    calibration: CalibrationFile
    instrument: Instrument
    runs: tuple[TouchRun, ...]
    files: tuple[Path, ...]
    viewers: Viewers
    pen_file: Path
    nominal_tip: FloatArray | None
    cone_cam: FloatArray | None
    drift: FloatArray
    witness: LampWitness | None

    @property
    def touches(self) -> list[tuple[str, Sequence[Touch]]]:
        return [(run.name, run.touches) for run in self.runs]


@printing
def _fixed_point(options: argparse.Namespace) -> None:
    measured = _measure(options, [tuple(options.images)])
    found = measure_fixed_point(
        measured.runs[0].touches,
        measured.instrument,
        _limits(options),
        measured.nominal_tip,
        measured.cone_cam,
        measured.drift,
    )
    _tell(
        *(options, measured, fixed_point_text, found, "fixed point"),
        fixed_point_entries(found, measured.instrument),
    )


@printing
def _circle(options: argparse.Namespace) -> None:
    measured = _measure(options, [(run,) for run in options.runs])
    inwards = 1.0 if options.surface == "bore" else -1.0
    found = measure_circle(
        measured.touches,
        measured.instrument,
        options.radius,
        _limits(options),
        certified_uncertainty=options.certified_uncertainty,
        ball_offset=inwards * (options.ball_diameter or 0.0) / 2,
        drift=measured.drift,
    )
    _tell(
        *(options, measured, circle_text, found, "circle"),
        circle_entries(found, measured.instrument),
    )


@printing
def _length(options: argparse.Namespace) -> None:
    measured = _measure(options, [(run,) for run in options.runs])
    outwards = 1.0 if options.faces == "inner" else -1.0
    found = measure_length(
        measured.touches,
        measured.instrument,
        options.length,
        _limits(options),
        certified_uncertainty=options.certified_uncertainty,
        ball_offset=outwards * (options.ball_diameter or 0.0) / 2,
        drift=measured.drift,
    )
    _tell(
        *(options, measured, length_text, found, "length"),
        length_entries(found, measured.instrument),
    )


@printing
def _articulation(options: argparse.Namespace) -> None:
    measured = _measure(options, [(run,) for run in options.runs])
    postures = by_posture(measured.touches)
    found = measure_articulation(postures, measured.instrument, _limits(options))
    _tell(
        *(options, measured, articulation_text, found, "articulation"),
        articulation_entries(found),
    )


@printing
def _drift(options: argparse.Namespace) -> None:
    measured = _measure(options, [(run,) for run in options.runs])
    found = measure_drift(measured.touches, measured.instrument, _limits(options))
    _tell(*(options, measured, drift_text, found, "drift"), drift_entries(found))


@printing
def _touches(options: argparse.Namespace) -> None:
    measured = _measure(options, [(run,) for run in options.runs])
    touches = [touch for run in measured.runs for touch in run.touches]
    if options.ball_diameter is not None:
        if options.along == "axis":
            touches = [replace(touch, approach_cam=None) for touch in touches]
        radius = options.ball_diameter / 2
        touches = [on_surface(touch, radius) for touch in touches]
    rejected = [each for run in measured.runs for each in run.rejected]
    print(shown(touches_text(touches, measured.instrument, rejected)))
    _tell_witness(measured)
    if options.json is not None:
        entries = [touch_entries(touch, measured.instrument) for touch in touches]
        _write(options, measured, "touches", {"touches": entries}, None)


def _measure(
    options: argparse.Namespace, places: Sequence[tuple[str, ...]]
) -> _Measured:
    drift: Path | None = getattr(options, "drift", None)
    inputs = options.camera, options.rig, options.pen, options.tip, drift
    require_other_file(options.json, *inputs)
    calibration = read_calibration(options.tip)
    given = read_viewers(options.camera, options.rig)
    rig = None if given is None else given.rig
    found = [touch_place(each, rig) for each in places]
    viewers = given or found[0].viewers
    if viewers is None:
        raise lacking("--camera or --rig")
    pen, pen_file = _pen(options, found[0])
    for place in found:
        require_other_file(options.json, *place.files)
    instrument = instrument_of(calibration, viewers, pen, pen_file)
    settling = 0 if options.frames == 1 else SETTLING
    rules = TouchRules(options.frames, settling)
    runs = []
    with progress("Finding LEDs") as report:
        for place in found:
            runs.append(touch_run(place, instrument, rules))
            report(len(runs) / len(found))
    nominal = getattr(options, "nominal_tip", None)
    for known in (pen.nominal_tip, calibration.nominal_tip):
        nominal = known if nominal is None else nominal
    witness = witness_of(runs, instrument, _limits(options))
    moved = NO_DRIFT if drift is None else read_drift(drift)
    return _Measured(
        calibration=calibration,
        instrument=instrument,
        runs=tuple(runs),
        files=tuple(file for place in found for file in place.files),
        viewers=viewers,
        pen_file=pen_file,
        nominal_tip=None if nominal is None else np.array(nominal, dtype=np.float64),
        cone_cam=cone_before(calibration, viewers),
        drift=moved if witness is None else np.maximum(moved, witness.share),
        witness=witness,
    )


def _pen(options: argparse.Namespace, place: TouchPlace) -> tuple[Pen, Path]:
    if options.pen is not None:
        pen = read_pen(options.pen, options.units, options.led_diameter, None)
        return pen, options.pen
    if place.pen is None or place.pen_file is None:
        raise lacking("--pen")
    return place.pen, place.pen_file


def _limits(options: argparse.Namespace) -> VerificationLimits:
    given = {
        item.name: getattr(options, f"limit_{item.name}")
        for item in fields(VerificationLimits)
        if hasattr(options, f"limit_{item.name}")
    }
    return replace(VerificationLimits(), **given)


def _tell(
    options: argparse.Namespace,
    measured: _Measured,
    text: Callable[[Any, Any], str],
    found: Any,
    kind: str,
    entries: Mapping[str, Any],
) -> None:
    """Print a verification, and write its record if that is wanted."""
    rejected = [each for run in measured.runs for each in run.rejected]
    judged = judged_with(found.assessment, measured.witness)
    print(shown(text(replace(found, assessment=judged), rejected)))
    _tell_witness(measured, judged)
    if not measured.calibration.has_checksum:
        print(
            "The calibration was written by a version that kept no checksum: whether "
            "it was changed since is not known."
        )
    if options.json is not None:
        _write(options, measured, kind, entries, judged)


def _tell_witness(measured: _Measured, judged: Conformity | None = None) -> None:
    """Print what fixed lamps tell, unless it is the verdict."""
    told = None if measured.witness is None else measured.witness.assessment
    if told is not None and told is not judged:
        print(shown(str(told.reason)))


def _write(
    options: argparse.Namespace,
    measured: _Measured,
    kind: str,
    entries: Mapping[str, Any],
    assessment: Conformity | None,
) -> None:
    rejected = [each for run in measured.runs for each in run.rejected]
    limits = asdict(_limits(options))
    record = verification_record(
        kind,
        {
            **entries,
            "rejected": rejected_entries(rejected),
            "witness": witness_entries(measured.witness),
        },
        assessment,
        {name: limits[name] for name in limits if hasattr(options, f"limit_{name}")},
        {
            "tip": file_entry(hashed(options.tip)),
            **viewer_entries(measured.viewers),
            "pen": file_entry(hashed(measured.pen_file)),
            "images": [file_entry(file) for file in all_hashed(measured.files)],
            **_drift_entry(options),
        },
    )
    write_record(options.json, record)


def _drift_entry(options: argparse.Namespace) -> dict[str, Any]:
    drift: Path | None = getattr(options, "drift", None)
    return {} if drift is None else {"drift": file_entry(hashed(drift))}
