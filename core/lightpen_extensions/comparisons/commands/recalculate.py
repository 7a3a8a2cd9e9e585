"""``lightpen recalculate``: recompute calibrations and check their uncertainty."""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.commands.arguments import add_json, whole_number
from lightpen.commands.console import (
    printing,
    progress,
    require_other_file,
    shown,
    write_record,
)
from lightpen.errors import CalibrationError, UsageError
from lightpen.formats.own_json import plain
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen.record.recomputing import recompute
from lightpen_extensions.comparisons.monte_carlo import (
    MIN_TRIALS,
    MonteCarlo,
    local_workers,
    run_monte_carlo,
)

TITLE, COLUMN = 30, 13  # characters


@dataclass(frozen=True, eq=False)
class Recalculated:
    """A calibration solved again: tip (3,) and its change, mm; or why there is none."""

    name: str
    tip_pen: FloatArray | None
    change: FloatArray | None
    fault: str = ""


def add_recalculate(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen recalculate``."""
    parser.set_defaults(run=_recalculate)
    parser.add_argument(
        "results", nargs="+", type=Path, metavar="RESULT.json", help="calibrations"
    )
    parser.add_argument(
        "--monte-carlo",
        type=_n_trials,
        metavar="N",
        help="number of simulated calibrations to check each uncertainty",
    )
    parser.add_argument(
        "--workers",
        type=whole_number,
        metavar="N",
        help="processes on this machine (default: one per core)",
    )
    add_json(parser)


def _n_trials(text: str) -> int:
    number = whole_number(text)
    if number < MIN_TRIALS:
        raise argparse.ArgumentTypeError(f"at least {MIN_TRIALS} trials are needed.")
    return number


@printing
def _recalculate(options: argparse.Namespace) -> None:
    require_other_file(options.json, *options.results)
    files = [read_calibration(path) for path in options.results]
    trials = {}
    with (
        local_workers(options.workers) as in_workers,
        progress("Calculating") as report,
    ):
        solved = in_workers(_recalculated, files, report)
        for path in options.results if options.monte_carlo is not None else ():
            found = recompute(path)
            if found.inputs.rig is not None:
                raise UsageError("recalculate.of-rig", path=path)
            trials[path.name] = run_monte_carlo(
                found.calibration, options.monte_carlo, in_workers, report
            )
    print(shown(_text(solved, trials)))
    if options.json is not None:
        write_record(options.json, _record(solved, trials))


def _recalculated(file: CalibrationFile) -> Recalculated:
    """Return a calibration solved again by its record alone, in another process."""
    try:
        tip = recompute(file.path).calibration.joint.tip_pen
    except (CalibrationError, UsageError) as error:
        return Recalculated(file.path.name, None, None, str(error.message))
    return Recalculated(file.path.name, tip, tip - file.tip_pen)


def _text(solved: list[Recalculated], trials: dict[str, MonteCarlo]) -> str:
    lines = [
        f"{'Tip in the pen frame, mm':<{TITLE}}"
        + "".join(f"{axis:>{COLUMN}}" for axis in "xyz")
    ]
    for each in solved:
        if each.tip_pen is None or each.change is None:
            lines.append(f"{each.name}: {each.fault}")
            continue
        lines.append(_row(each.name, each.tip_pen))
        lines.append(_row("  change", each.change))
        found = trials.get(each.name)
        if found is not None:
            lines += [
                _row("  U (k = 2), linear", 2 * found.linear),
                _row("  U (k = 2), Monte Carlo", 2 * found.deviation),
                _row("    known to", 2 * found.precision),
                _row("    difference / that", found.difference),
                f"  {len(found.errors)} trials, {found.n_failed} without a tip",
                f"  {found.explanation}",
            ]
    return "\n".join(lines)


def _row(title: str, values: FloatArray) -> str:
    return f"{title[:TITLE]:<{TITLE}}" + "".join(f"{x:{COLUMN}.4f}" for x in values)


def _record(
    solved: list[Recalculated], trials: dict[str, MonteCarlo]
) -> dict[str, object]:
    entries = []
    for each in solved:
        found = trials.get(each.name)
        entries.append(
            {
                "name": each.name,
                "tip_pen_mm": each.tip_pen,
                "change_mm": each.change,
                "fault": each.fault,
                "monte_carlo": (
                    None
                    if found is None
                    else {
                        "trials": len(found.errors),
                        "failed": found.n_failed,
                        "linear_standard_uncertainty_mm": found.linear,
                        "standard_uncertainty_mm": found.deviation,
                        "precision_mm": found.precision,
                        "difference_in_precisions": found.difference,
                        "interval_95_mm": np.asarray(found.interval),
                        "explanation": str(found.explanation),
                    }
                ),
            }
        )
    return {"calibrations": plain(entries)}
