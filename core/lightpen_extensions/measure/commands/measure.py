"""``lightpen measure`` and ``lightpen verify``: parts by a plan, checks of the tip."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from lightpen.commands.arguments import above_zero, add_json, finite, not_negative
from lightpen.commands.console import (
    DONE,
    printing,
    require_other_file,
    shown,
    write_record,
)
from lightpen.errors import FileError, UsageError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.files import FileFormat, write_whole
from lightpen.messages import Message, message
from lightpen.model.artefacts import REFERENCE, Artefact, ArtefactKind, Side
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.record.swings.reading import is_record
from lightpen_extensions.comparisons.assessment import (
    COLUMN,
    VERIFY_AGAIN,
    VerificationAssessment,
    check,
    rule_in_words,
    verdict_lines,
)
from lightpen_extensions.comparisons.commands.entering import (
    add_ball,
    add_entering,
    add_limits,
    add_verdict,
    keep_record,
    verdict_status,
)
from lightpen_extensions.comparisons.commands.pens import (
    add_verify_pen,
    add_verify_press,
)
from lightpen_extensions.measure.commands.touched import (
    MeasuredRuns,
    add_runs,
    add_touch_inputs,
    given_runs,
    measure_runs,
)
from lightpen_extensions.measure.measuring.plan import Plan
from lightpen_extensions.measure.measuring.plan_checks import read_plan
from lightpen_extensions.measure.measuring.report import EXPORTS, ResultRow, ResultTable
from lightpen_extensions.measure.tasks.drift import DRIFT
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.probed_point import (
    ProbedPoint,
    RejectedFrame,
    point_entries,
)
from lightpen_extensions.measure.tasks.registry import (
    AnyTask,
    measure_artefacts,
    size_table,
)
from lightpen_extensions.measure.tasks.task import (
    Found,
    Runs,
    VerificationChoices,
    rule_of,
)

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
    _add_drift(parser)
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
    for path, export in exports.items():
        write_whole(path, export.encoded(found.part))
    tables = PART.tables(found, conditions)
    return _concluded(given, measured, PART, found, tables, choices)


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


RING_SIDES = {"bore": Side.INSIDE, "boss": Side.OUTSIDE}
FACE_SIDES = {"outer": Side.OUTSIDE, "inner": Side.INSIDE}


def add_verify(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen verify`` and its tasks."""
    kinds = parser.add_subparsers(required=True, metavar="TASK")
    check = "the cone, probed in new postures"
    _add_fixed_point(kinds.add_parser("fixed-point", help=check))
    motion = "motion of camera or cone during a session"
    _add_drift_check(kinds.add_parser("drift", help=motion))
    _add_circle(kinds.add_parser("circle", help="a ring of certified radius"))
    _add_length(kinds.add_parser("length", help="a certified length"))
    add_verify_pen(kinds.add_parser("pen", help="LED stability over several swings"))
    add_verify_press(
        kinds.add_parser("press", help="a swing with firm pressure against a usual one")
    )


def _add_fixed_point(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_verify_task, task=FIXED_POINT, ball_diameter=None)
    add_runs(parser, "points in the cone, each in another posture")
    parser.add_argument(
        "--nominal-tip",
        type=finite,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="nominal tip centre, pen frame, mm",
    )
    _add_drift(parser)
    _add_common(parser, *FIXED_POINT.limits)


def _add_drift_check(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_verify_task, task=DRIFT, ball_diameter=None)
    add_runs(parser, "one visit of a fixed cone, in order of time")
    _add_common(parser, *DRIFT.limits)


def _add_circle(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_verify_artefact, kind=ArtefactKind.RING, sides=RING_SIDES)
    parser.set_defaults(temperature=REFERENCE, temperature_uncertainty=0.0)
    parser.set_defaults(expansion=0.0)
    add_runs(parser, "once round the ring")
    _add_size(parser, "--radius", "certified radius", "--surface")
    _add_common(parser, "radius", "form")


def _add_length(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(
        run=_verify_artefact, kind=ArtefactKind.LENGTH, sides=FACE_SIDES
    )
    add_runs(parser, "both ends of the length at one place")
    help_ = f"certified length at {REFERENCE:g} degrees Celsius, of all runs or of each"
    _add_size(parser, "--length", help_, "--faces")
    parser.add_argument(
        "--temperature",
        type=finite,
        default=REFERENCE,
        metavar="CELSIUS",
        help=f"temperature of the artefact ({REFERENCE:g})",
    )
    parser.add_argument(
        "--temperature-uncertainty",
        type=not_negative,
        default=1.0,
        metavar="K",
        help="U (k = 2) of the temperature (1)",
    )
    parser.add_argument(
        "--expansion",
        type=not_negative,
        default=0.0,
        metavar="PPM/K",
        help="coefficient of thermal expansion of the artefact, such as 11.5 for steel "
        "(0: none)",
    )
    _add_common(parser, "length", "length_per_m")


def _add_size(
    parser: argparse.ArgumentParser, argument: str, meaning: str, surface: str
) -> None:
    """Add a certified size with its U, and the surface that the ball touches."""
    parser.set_defaults(size_option=argument)
    parser.add_argument(
        argument,
        dest="sizes",
        type=above_zero,
        nargs="+",
        required=True,
        metavar="MM",
        help=meaning,
    )
    parser.add_argument(
        "--certified-uncertainty",
        type=not_negative,
        default=0.0,
        metavar="MM",
        help="U (k = 2) of the certified value",
    )
    sides = parser.get_default("sides")
    parser.add_argument(
        surface,
        dest="surface",
        choices=tuple(sides),
        default=next(iter(sides)),
        help="what was probed; only with --ball-diameter",
    )
    add_ball(parser, "ball diameter, if surfaces were touched, no groove nor cones")
    _add_drift(parser)


def _add_drift(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--drift",
        type=Path,
        metavar="DRIFT.json",
        help="record of `verify drift` from the same session; U includes the drift",
    )


def _add_common(parser: argparse.ArgumentParser, *limits: str) -> None:
    add_touch_inputs(parser, "calibration to verify")
    add_limits(parser, *limits)
    add_json(parser)
    add_verdict(parser)
    add_entering(parser)


@printing
def _verify_task(given: argparse.Namespace) -> int:
    task: AnyTask = given.task
    measured = given_runs(given, is_pooled=task is FIXED_POINT)
    found = task.measure(measured.touches, measured.conditions, VerificationChoices())
    tables = task.tables(found, measured.conditions)
    return _concluded(given, measured, task, found, tables)


@printing
def _verify_artefact(given: argparse.Namespace) -> int:
    measured = given_runs(given)
    n_runs = len(measured.runs)
    if len(given.sizes) not in (1, n_runs):
        raise UsageError(
            "cli.number-of-each-run",
            option=given.size_option,
            n_given=len(given.sizes),
            n_runs=n_runs,
        )
    artefacts = [
        Artefact(
            given.kind,
            size,
            given.certified_uncertainty,
            given.sides[given.surface] if given.ball_diameter else Side.CENTRE,
            given.temperature,
            given.temperature_uncertainty,
            given.expansion,
        )
        for size in (given.sizes * n_runs)[:n_runs]
    ]
    found = measure_artefacts(
        str(given.kind), artefacts, measured.touches, measured.conditions
    )
    return _concluded(given, measured, PART, found, [size_table(found)])


def _concluded(
    given: argparse.Namespace,
    measured: MeasuredRuns,
    task: AnyTask,
    found: Found,
    tables: Sequence[ResultTable],
    choices: VerificationChoices | None = None,
) -> int:
    """Print, keep and return what was found."""
    judged, limits = found.assessment, measured.conditions.limits
    if choices is None and judged.is_accepted and measured.n_of_calibration:
        n_own = measured.n_of_calibration
        judged = check(message("verification.own-images", n=n_own), VERIFY_AGAIN)
    rule = rule_in_words(limits) if choices is None else rule_of(choices, limits)
    remarks = measured.instrument.remarks
    print(shown(found_text(tables, judged, measured.rejected, rule, remarks)))
    entries = task.entries(found, measured.instrument)
    record = measured.record(given, task.kind, entries, judged, rule)
    keep_record(given, record, measured.calibration, measured.origin)
    return verdict_status(given, judged.grade)


MOST_COLUMNS = 10  # runs beside each other
MOST_NAMED = 5  # images
NAME = 28  # characters


def found_text(
    tables: Sequence[ResultTable],
    assessment: VerificationAssessment,
    rejected: Sequence[RejectedFrame],
    rule: Message,
    remarks: Sequence[Message] = (),
) -> str:
    """Return the result of a task as text, with remarks on the instrument."""
    lines = [line for table in tables for line in _table(table)]
    lines += [*map(str, remarks), *_left_out(rejected)]
    return "\n".join([*lines, "", *verdict_lines(assessment, rule)])


def touches_text(
    touches: Sequence[ProbedPoint],
    instrument: Instrument,
    rejected: Sequence[RejectedFrame],
) -> str:
    """Return points with their uncertainty as text."""
    rows = []
    for touch in touches:
        spread = np.sqrt(np.diag(touch.covariance(instrument)))
        values = [*touch.point_cam.tolist(), *(COVERAGE_FACTOR * spread).tolist()]
        rows.append(ResultRow(touch.label, values))
    columns = (*"uvw", *(message("drift.axis", axis=axis) for axis in "uvw"))
    table = ResultTable(message("table.points"), columns, tuple(rows))
    lines = [*_table(table), "U has k = 2.", *map(str, instrument.remarks)]
    return "\n".join([*lines, *_left_out(rejected)])


def _table(table: ResultTable) -> list[str]:
    """Return a table as lines; one of many columns is parted."""
    lines, n_columns = [f"{table.title}"], len(table.columns)
    for first in range(0, n_columns, MOST_COLUMNS):
        own = slice(first, first + MOST_COLUMNS)
        heads = [str(head) for head in table.columns[own]]
        width = max(COLUMN, *(len(head) + 2 for head in heads))
        lines.append(" " * NAME + "".join(f"{head:>{width}}" for head in heads))
        for row in table.rows:
            cells = "".join(f"{text:>{width}}" for text in row.texts()[own])
            words = f"{str(row.name)[:NAME]:<{NAME}}{cells}"
            lines.append(f"{words}  {row.remark}" if row.remark else words)
    return [line.rstrip() for line in (*lines, *map(str, table.notes))]


def _left_out(rejected: Sequence[RejectedFrame]) -> list[str]:
    if not rejected:
        return []
    named = ", ".join(f"{each.name} ({each.reason})" for each in rejected[:MOST_NAMED])
    more = ", ..." if len(rejected) > MOST_NAMED else ""
    return [f"{len(rejected)} images left out: {named}{more}"]
