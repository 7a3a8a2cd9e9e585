"""``lightpen measure``: measure a part by a plan, or points alone."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from lightpen.commands.arguments import add_ball, add_json, add_verdict
from lightpen.commands.console import (
    DONE,
    printing,
    require_other_file,
    shown,
    verdict_status,
    write_record,
)
from lightpen.commands.entering import add_entering, keep_record
from lightpen.errors import FileError, UsageError
from lightpen.formats.file_format import FileFormat
from lightpen.formats.files import write_whole
from lightpen.model.limits import rule_in_words
from lightpen.record.swings.reading import is_record
from lightpen_extensions.measure.commands.touched import (
    MeasuredRuns,
    add_touch_inputs,
    measure_runs,
)
from lightpen_extensions.measure.measuring.exports import EXPORTS
from lightpen_extensions.measure.measuring.plan import Plan
from lightpen_extensions.measure.measuring.plan_checks import read_plan
from lightpen_extensions.measure.probing.drift_reference import judged_with
from lightpen_extensions.measure.reports.summaries import found_text, touches_text
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.probed_point import point_entries
from lightpen_extensions.measure.tasks.task import Runs, VerificationChoices, rule_of

POINTS = "points"


def add_measure(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen measure``."""
    parser.set_defaults(run=_measure)
    parser.add_argument(
        "plan",
        type=Path,
        metavar="PLAN.yaml",
        help=f"measuring plan; or the word {POINTS}, for points with U alone",
    )
    parser.add_argument(
        "touches",
        nargs="+",
        metavar="TOUCHES",
        help="FEATURE=IMAGES for each feature of the plan (image folder, pattern, "
        "video, record, or LED centres as CSV), or a folder with a folder or CSV file "
        "for each feature, or the record of a session of the window; "
        f"of {POINTS}: IMAGES",
    )
    add_touch_inputs(parser, "calibration to measure with")
    add_ball(
        parser, "default: that of the calibrated tip, if known; 0: no compensation"
    )
    parser.add_argument(
        "--drift",
        type=Path,
        metavar="DRIFT.json",
        help="record of `verify drift` from the same session; U includes the drift",
    )
    parser.add_argument(
        "--export",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="; ".join(f"{each.suffix}: {each.label}" for each in EXPORTS),
    )
    add_json(parser)
    add_entering(parser)
    add_verdict(parser)


@printing
def _measure(given: argparse.Namespace) -> int:
    return _measure_points(given) if str(given.plan) == POINTS else _by_plan(given)


def _measure_points(given: argparse.Namespace) -> int:
    """Measure points, the centres of the ball."""
    given.plan = None
    centers = [Path(at) for at in given.touches if _is_csv(at)]
    images = [(at,) for at in given.touches if not _is_csv(at)]
    measured = measure_runs(given, images, centers)
    touches = [touch for run in measured.runs for touch in run.touches]
    print(shown(touches_text(touches, measured.instrument, measured.rejected)))
    measured.print_lamp_drift()
    if given.json is not None:
        entries = {"touches": point_entries(touches, measured.instrument)}
        rule = rule_in_words(measured.conditions.limits)
        write_record(given.json, measured.record(given, POINTS, entries, None, rule))
    return DONE


def _by_plan(given: argparse.Namespace) -> int:
    require_other_file(given.json, given.plan)
    exports = {path: _export_of(path) for path in given.export}
    plan = read_plan(given.plan)
    if len(given.touches) == 1 and is_record(Path(given.touches[0])):
        measured = measure_runs(given, [tuple(given.touches)])
        return _measured(given, plan, measured, measured.touches, exports)
    places = _places(plan, given.touches)
    centers = {name: Path(at) for name, at in places.items() if _is_csv(at)}
    images = {name: at for name, at in places.items() if name not in centers}
    measured = measure_runs(
        given, [(place,) for place in images.values()], tuple(centers.values())
    )
    names = [*centers, *images]
    runs = [(name, run.touches) for name, run in zip(names, measured.runs, strict=True)]
    return _measured(given, plan, measured, runs, exports)


def _measured(
    given: argparse.Namespace,
    plan: Plan,
    measured: MeasuredRuns,
    runs: Runs,
    exports: Mapping[Path, FileFormat],
) -> int:
    """Print, keep and return what was measured, by runs in the order of the plan."""
    conditions = measured.conditions
    if given.ball_diameter is None:
        ball = measured.calibration.names.ball_diameter
        conditions = replace(conditions, ball_diameter=ball)
    choices = VerificationChoices(PART.kind, plan)
    found = PART.measure(runs, conditions, choices)
    judged = judged_with(found.assessment, measured.lamp_drift)
    tables = PART.tables(found, conditions)
    rule = rule_of(choices, conditions.limits)
    remarks = conditions.instrument.remarks
    print(shown(found_text(tables, judged, measured.rejected, rule, remarks)))
    entries = PART.entries(found, measured.instrument)
    record = measured.record(given, PART.kind, entries, judged, rule)
    for path, export in exports.items():
        write_whole(path, export.encoded(found.part))
    keep_record(given, record, measured.calibration, measured.origin)
    return verdict_status(given, judged.grade)


def _export_of(path: Path) -> FileFormat:
    """Return the format that the end of a file name states."""
    for export in EXPORTS:
        if path.suffix.lower() == export.suffix:
            return export
    suffixes = ", ".join(each.suffix for each in EXPORTS)
    raise UsageError("measuring.no-format", file=path, suffixes=suffixes)


def _is_csv(place: str) -> bool:
    return Path(place).suffix.lower() == ".csv"


def _places(plan: Plan, given: Sequence[str]) -> dict[str, str]:
    """Return the locations of the touches of each feature, in order of the plan."""
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
        for path in sorted(folder.iterdir()):
            own = path.stem if _is_csv(path.name) else path.name
            if own in names:
                found[own] = str(path)
    for name in names:
        if name not in found:
            raise FileError("measuring.no-touches", name=name)
    return {name: found[name] for name in names}
