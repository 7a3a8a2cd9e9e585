"""``lightpen verify``: verify a tip on reference artefacts."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from lightpen.commands.arguments import (
    above_zero,
    add_conditions,
    add_json,
    add_limits,
    add_verdict,
    finite,
    not_negative,
)
from lightpen.commands.console import printing, shown, verdict_status, write_record
from lightpen.commands.entering import add_entering, keep_record
from lightpen.commands.pen_health import add_verify_pen, add_verify_press
from lightpen.commands.touched import MeasuredRuns, add_touch_inputs, measure_runs
from lightpen.errors import UsageError
from lightpen.messages import message
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import rule_in_words
from lightpen.verification.probing.drift_reference import judged_with
from lightpen.verification.reports.summaries import found_text, touches_text
from lightpen.verification.storage.verification_files import conditions_entries
from lightpen.verification.tasks.assessment import (
    VERIFY_AGAIN,
    VerificationAssessment,
    check,
)
from lightpen.verification.tasks.probed_point import (
    ProbedPoint,
    on_surface,
    point_entries,
)
from lightpen.verification.tasks.registry import TASKS, AnyTask
from lightpen.verification.tasks.task import (
    BALL_OPTION,
    BALL_UNCERTAINTY,
    NumberOption,
    SurfaceOption,
    TaskOptions,
)
from lightpen.verification.tasks.tip_evidence import block_diagonal


def add_verify(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen verify`` and its tasks."""
    kinds = parser.add_subparsers(required=True, metavar="TASK")
    for task in TASKS:
        _add_task(kinds.add_parser(task.command, help=task.summary), task)
    _add_touches(
        kinds.add_parser("touches", help="probed points with uncertainty; no verdict")
    )
    add_verify_pen(kinds.add_parser("pen", help="LED stability over several swings"))
    add_verify_press(
        kinds.add_parser("press", help="a swing with firm pressure against a usual one")
    )


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
                    nargs="+" if option.of_each_run else None,
                    required=is_needed,
                    default=getattr(task.options(), option.name),
                    metavar=option.unit.upper(),
                    help=option.help,
                )
            case SurfaceOption():
                parser.add_argument(
                    "--ball-diameter",
                    type=above_zero,
                    metavar="MM",
                    help=option.ball_help,
                )
                parser.add_argument(
                    option.argument,
                    dest=option.name,
                    choices=tuple(option.words),
                    default=next(iter(option.words)),
                    help="what was probed; only with --ball-diameter "
                    f"({next(iter(option.words))})",
                )
    if task.compares_nominal_tip:
        parser.add_argument(
            "--nominal-tip",
            type=finite,
            nargs=3,
            metavar=("X", "Y", "Z"),
            help="nominal tip centre, pen frame, mm",
        )
    if task.counts_drift:
        parser.add_argument(
            "--drift",
            type=Path,
            metavar="DRIFT.json",
            help="record of `verify drift` from the same session; U includes the drift",
        )
    _add_common(parser, *task.limits)
    add_verdict(parser)
    add_entering(parser)


def _add_touches(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_touches)
    _add_runs(parser, "points that were probed")
    parser.add_argument(
        "--ball-diameter",
        type=above_zero,
        metavar="MM",
        help="ball diameter; the points are then on the surface, not ball centres",
    )
    parser.add_argument(
        BALL_OPTION.argument,
        type=not_negative,
        default=BALL_UNCERTAINTY,
        metavar="MM",
        help=BALL_OPTION.help,
    )
    parser.add_argument(
        "--along",
        choices=("approach", "axis"),
        default="approach",
        help="direction from the ball centre to the surface: approach direction if "
        "the images show it, else the pen axis; or always the pen axis",
    )
    _add_common(parser)
    add_conditions(parser)


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
    add_touch_inputs(parser, "calibration to verify")
    add_limits(parser, *limits)
    add_json(parser)


@printing
def _verify_task(given: argparse.Namespace) -> int:
    task: AnyTask = given.task
    runs = [tuple(given.runs)] if task.is_pooled else [(run,) for run in given.runs]
    measured = _measure(given, runs)
    conditions = measured.conditions
    found = task.measure(measured.touches, conditions, _task_options(task, given))
    judged = judged_with(found.assessment, measured.lamp_drift)
    if judged.is_accepted and measured.n_of_calibration:
        n_own = measured.n_of_calibration
        judged = check(message("verification.own-images", n=n_own), VERIFY_AGAIN)
    rule = rule_in_words(conditions.limits)
    tables = task.tables(found, conditions)
    print(shown(found_text(tables, judged, measured.rejected, rule)))
    _print_lamp_drift(measured, judged)
    entries = task.entries(found, measured.instrument)
    record = measured.record(given, task.kind, entries, judged, rule)
    keep_record(given, record, measured.calibration, measured.origin)
    return verdict_status(given, judged.grade)


def _task_options(task: AnyTask, given: argparse.Namespace) -> TaskOptions:
    """Return the options of a task; without a ball, its centre runs in a groove."""
    values = {}
    for option in task.fields:
        match option:
            case NumberOption() if option.of_each_run:
                each = tuple(getattr(given, option.name))
                n_runs = len(given.centers) + len(given.runs)
                if len(each) not in (1, n_runs):
                    raise UsageError(
                        "cli.number-of-each-run",
                        option=option.argument,
                        n_given=len(each),
                        n_runs=n_runs,
                    )
                values[option.name] = each[0]
                values[option.of_each_run] = each if len(each) > 1 else ()
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
    instrument = measured.instrument
    if options.ball_diameter is not None:
        if options.along == "axis":
            touches = [replace(touch, approach_cam=None) for touch in touches]
        radius = options.ball_diameter / 2
        touches = [_on_surface(touch, radius) for touch in touches]
        of_ball = np.array([[(options.ball_uncertainty / 2 / COVERAGE_FACTOR) ** 2]])
        both = block_diagonal([instrument.covariance, of_ball])
        instrument = replace(instrument, covariance=both)
    print(shown(touches_text(touches, instrument, measured.rejected)))
    _print_lamp_drift(measured)
    if options.json is not None:
        entries = {
            **conditions_entries(options.pen_temperature, options.humidity),
            "touches": point_entries(touches, instrument),
        }
        rule = rule_in_words(measured.conditions.limits)
        record = measured.record(options, "touches", entries, None, rule)
        write_record(options.json, record)


def _on_surface(touch: ProbedPoint, radius: float) -> ProbedPoint:
    """Return a touch on the surface, with the ball radius as a further parameter."""
    on = on_surface(touch, radius)
    by_radius = (on.point_cam - touch.point_cam) / radius
    return replace(on, sensitivity=np.column_stack([on.sensitivity, by_radius]))


def _measure(
    options: argparse.Namespace, places: Sequence[tuple[str, ...]]
) -> MeasuredRuns:
    if bool(options.centers) == any(places):
        raise UsageError("cli.runs-or-centers")
    return measure_runs(options, places, options.centers)


def _print_lamp_drift(
    measured: MeasuredRuns, judged: VerificationAssessment | None = None
) -> None:
    """Print the drift of fixed lamps, unless it is the verdict."""
    drift = None if measured.lamp_drift is None else measured.lamp_drift.assessment
    if drift is not None and drift is not judged:
        print(shown(str(drift.reason)))
