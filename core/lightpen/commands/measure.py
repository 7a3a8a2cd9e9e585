"""``lightpen measure``: measure a part by a plan."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.commands.arguments import add_json, add_pen_options, not_negative
from lightpen.commands.console import (
    lacking,
    printing,
    progress,
    require_other_file,
    shown,
    write_record,
)
from lightpen.detection.observations import observe_centers
from lightpen.errors import FileError, UsageError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.hashes import all_hashed, hashed
from lightpen.formats.json_records import file_entry, plain, record_heading
from lightpen.formats.observation_files import read_centers
from lightpen.formats.pen_files import read_pen
from lightpen.local_time import local_now
from lightpen.measuring.part import measure_part
from lightpen.measuring.plan import Plan, read_plan
from lightpen.measuring.report import part_entries, part_text
from lightpen.measuring.touches import PartTouches
from lightpen.model.posture import UPRIGHT_AXIS
from lightpen.record.calibrations.calibrations import read_calibration
from lightpen.verification.probing.image_locations import (
    PenCameras,
    read_viewers,
    touch_place,
)
from lightpen.verification.probing.probing import FAST, SETTLING, ProbingRules
from lightpen.verification.probing.sources import instrument_of, touch_run, touches_of
from lightpen.verification.storage.verification_files import viewer_entries
from lightpen.verification.tasks.probed_point import ProbedPoint, joint_covariance


def add_measure(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen measure``."""
    parser.set_defaults(run=_measure)
    parser.add_argument("plan", type=Path, metavar="PLAN.yaml")
    parser.add_argument(
        "touches",
        nargs="+",
        metavar="TOUCHES",
        help="FEATURE=IMAGES for each feature of the plan (image folder, pattern, "
        "video, record, or LED centres as CSV), or a folder with a folder or CSV file "
        "for each feature",
    )
    parser.add_argument("--tip", type=Path, required=True, metavar="RESULT.json")
    parser.add_argument("--camera", type=Path, metavar="FILE")
    parser.add_argument(
        "--rig", type=Path, metavar="FILE", help="rig file, instead of --camera"
    )
    parser.add_argument("--pen", type=Path, metavar="FILE")
    add_pen_options(parser)
    parser.add_argument(
        "--ball-diameter",
        type=not_negative,
        metavar="MM",
        help="default: that of the calibrated tip, if known; 0 for its centre",
    )
    parser.add_argument(
        "--ball-uncertainty",
        type=not_negative,
        default=0.001,
        metavar="MM",
        help="U (k = 2) of the ball diameter (0.001)",
    )
    parser.add_argument(
        "--frames",
        type=int,
        choices=range(1, 101),
        default=FAST,
        metavar="N",
        help=f"images of a touch ({FAST}); 1: each image is a touch",
    )
    add_json(parser)


@printing
def _measure(options: argparse.Namespace) -> None:
    require_other_file(
        options.json,
        options.plan,
        options.camera,
        options.rig,
        options.pen,
        options.tip,
    )
    plan = read_plan(options.plan)
    calibration = read_calibration(options.tip)
    viewers = read_viewers(options.camera, options.rig)
    if viewers is None:
        raise lacking("--camera or --rig")
    if options.pen is None:
        raise lacking("--pen")
    pen = read_pen(options.pen, options.units, options.led_diameter, None)
    instrument = instrument_of(calibration, viewers, pen, options.pen)
    settling = 0 if options.frames == 1 else SETTLING
    rules = ProbingRules(options.frames, settling)
    places = list(_places(plan, options.touches))
    found: list[tuple[str, ProbedPoint]] = []
    files: list[Path] = []
    with progress("Finding LEDs") as report:
        for i, (name, place) in enumerate(places):
            points, own = _points(place, instrument, viewers, rules)
            found += [(name, point) for point in points]
            files += own
            report((i + 1) / len(places))
    require_other_file(options.json, *files)
    ball = options.ball_diameter
    if ball is None:
        ball = calibration.names.ball_diameter or 0.0
    touches = part_touches(found, instrument, ball, options.ball_uncertainty)
    part = measure_part(plan, touches)
    print(shown(part_text(part)))
    if options.json is not None:
        record = {
            **record_heading(local_now()),
            **part_entries(part),
            "inputs": {
                "plan": file_entry(hashed(options.plan)),
                "tip": file_entry(hashed(options.tip)),
                **viewer_entries(viewers),
                "pen": file_entry(hashed(options.pen)),
                "touches": [file_entry(file) for file in all_hashed(files)],
            },
        }
        write_record(options.json, {key: plain(entry) for key, entry in record.items()})


def part_touches(
    found: Sequence[tuple[str, ProbedPoint]],
    instrument: Instrument,
    ball_diameter: float,
    ball_uncertainty: float,
) -> PartTouches:
    """Return probed points as the touches of a part.

    Parameters
    ----------
    found : sequence of (str, ProbedPoint)
        Feature and point of each touch.
    ball_diameter, ball_uncertainty : float
        mm; U (k = 2) of the diameter.
    """
    points = [point for _, point in found]
    return PartTouches(
        points_cam=np.array([point.point_cam for point in points]),
        covariance=joint_covariance(points, instrument),
        approaches_cam=np.array([_approach(point) for point in points]),
        styli_cam=np.array([point.rotation @ UPRIGHT_AXIS for point in points]),
        owners=tuple(name for name, _ in found),
        ball_radius=ball_diameter / 2,
        ball_uncertainty=ball_uncertainty / 2,
    )


def _approach(point: ProbedPoint) -> FloatArray:
    return np.full(3, np.nan) if point.approach_cam is None else point.approach_cam


def _places(plan: Plan, given: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the feature and the place of its touches."""
    names = [feature.name for feature in plan.features]
    found: dict[str, str] = {}
    for text in given:
        name, equals, place = text.partition("=")
        if equals and name in names:
            found[name] = place
            continue
        folder = Path(text)
        if not folder.is_dir():
            raise UsageError(
                "measuring.unknown-feature", name=name, names=", ".join(names)
            )
        for known in names:
            for path in (folder / known, folder / f"{known}.csv"):
                if path.exists():
                    found[known] = str(path)
    for name in names:
        if name not in found:
            raise FileError("measuring.no-touches", name=name)
        yield name, found[name]


def _points(
    place: str, instrument: Instrument, viewers: PenCameras, rules: ProbingRules
) -> tuple[Sequence[ProbedPoint], Sequence[Path]]:
    """Return the touches at a place, and its files."""
    path = Path(place)
    if path.suffix.lower() == ".csv":
        centers = read_centers(path, instrument.pen.n_leds)
        seen = observe_centers(centers, instrument.camera, instrument.pen)
        return touches_of(place, (seen,), instrument, rules).touches, (path,)
    where = touch_place((place,), viewers.rig)
    return touch_run(where, instrument, rules).touches, where.files
