"""``lightpen verify pen`` and ``verify press``: swings of one pen."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from lightpen.commands.arguments import add_file, add_json, supervisor_signature
from lightpen.commands.console import printing, require_other_file, shown
from lightpen.errors import UsageError
from lightpen.formats.opened_files import all_hashed
from lightpen.formats.own_json import file_entry
from lightpen.local_time import local_now
from lightpen.model.names import Origin
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen.record.library.library_changes import Author
from lightpen.record.recomputing import recompute, recorded_camera_and_pen
from lightpen.record.results.result_folder import data_folder_of
from lightpen_extensions.comparisons.assessment import (
    BY_SIMPLE_ACCEPTANCE,
    COLUMN,
    TITLE,
    verdict_lines,
    verification_record,
)
from lightpen_extensions.comparisons.commands.entering import (
    add_entering,
    add_exit_by_verdict,
    keep_record,
    verdict_status,
)
from lightpen_extensions.comparisons.pen_health import (
    MOVED,
    PenHealth,
    examine_pen,
    require_one_pen,
)
from lightpen_extensions.comparisons.press_test import (
    PRESS_TEST,
    PressTest,
    keep_bending,
    press_test,
)


def add_verify_pen(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen verify pen``."""
    parser.set_defaults(run=_verify_pen)
    parser.add_argument(
        "results",
        nargs="+",
        type=Path,
        metavar="RESULT.json",
        help="calibrations with this pen, in any order",
    )
    add_exit_by_verdict(parser)
    add_json(parser)
    add_entering(parser)


@printing
def _verify_pen(options: argparse.Namespace) -> int:
    require_other_file(options.json, *options.results)
    swings = sorted(map(read_calibration, options.results), key=lambda one: one.when)
    _, pen = recorded_camera_and_pen(swings[0])
    found = examine_pen(swings, pen.leds)
    print(shown(pen_health_text(found)))
    record = verification_record(
        "pen",
        pen_health_entries(found),
        found.assessment,
        {"led_moved": MOVED},
        {"files": [file_entry(file) for file in all_hashed(options.results)]},
    )
    keep_record(options, record, swings[0])
    return verdict_status(options, found.assessment.grade)


def add_verify_press(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen verify press``."""
    parser.set_defaults(run=_verify_press)
    add_file(parser, "light", "LIGHT.json", "calibration with light pressure")
    parser.add_argument(
        "firm",
        type=Path,
        metavar="FIRM.json",
        help="calibration with firm pressure: same tip, cone, pen and camera",
    )
    parser.add_argument(
        "--supervisor",
        metavar="NAME",
        help="supervisor who signs, if the data folder has a supervisor password",
    )
    add_exit_by_verdict(parser)
    add_json(parser)
    add_entering(parser)


@printing
def _verify_press(options: argparse.Namespace) -> int:
    files = [options.light, options.firm]
    require_other_file(options.json, *files)
    light, firm = both = [read_calibration(path) for path in files]
    require_one_pen(both)
    if light.camera_hashes != firm.camera_hashes:
        raise UsageError("press-test.another-camera", first=light.name, other=firm.name)
    if (light.tip_pen == firm.tip_pen).all():
        raise UsageError("repeatability.twice", one=light.name, other=firm.name)
    found = press_test(*(recompute(path).calibration for path in files))
    print(shown(press_test_text(found)))
    record = verification_record(
        PRESS_TEST,
        found.entries,
        found.assessment,
        {},
        {"files": [file_entry(file) for file in all_hashed(files)]},
    )
    keep_record(options, record, light)
    _keep_bending(options, light, found)
    return verdict_status(options, found.assessment.grade)


def _keep_bending(
    options: argparse.Namespace, light: CalibrationFile, found: PressTest
) -> None:
    """Store the bending with the tip in the library of a data folder."""
    data: Path | None = options.data or data_folder_of(light.path)
    now, names = local_now(), light.names
    bending = found.bending(now.date())
    if bending is None or data is None or options.no_entry or not names.tip:
        return
    if light.origin is Origin.SIMULATED:
        return
    signature = supervisor_signature(options.supervisor)
    by = Author(names.station, names.operator, "press test", signature)
    keep_bending(data, names.tip, bending, by, now)
    print(shown(f"Stored with tip {names.tip}, due {bending.due}."))


def pen_health_entries(found: PenHealth) -> dict[str, Any]:
    """Return the entries of a pen's history."""
    return {
        "moved_leds": found.moved,
        "swings": [
            {"name": swing.name, "shifts_mm": swing.shifts} for swing in found.swings
        ],
    }


def pen_health_text(found: PenHealth) -> str:
    """Return a pen over its swings as text."""
    n_leds = len(found.swings[0].shifts)
    lines = [
        "LEDs since the first swing, mm",
        f"{'Swing':<{TITLE}}"
        + "".join(f"{f'LED {j + 1}':>{COLUMN}}" for j in range(n_leds)),
    ]
    for swing in found.swings:
        lengths = np.linalg.norm(swing.shifts, axis=1)
        cells = "".join(
            f"{x:{COLUMN}.3f}" if np.isfinite(x) else f"{'-':>{COLUMN}}"
            for x in lengths
        )
        lines.append(f"{swing.name[:TITLE]:<{TITLE}}{cells}")
    by_rule = verdict_lines(found.assessment, BY_SIMPLE_ACCEPTANCE)
    return "\n".join([*lines, "", *by_rule])


def press_test_text(found: PressTest) -> str:
    """Return the change by firm pressure as text."""
    names = ("Tip x", "Tip y (along pen)", "Tip z")
    lines = [f"{'Firm less light, mm':<{TITLE}}{'change':>{COLUMN}}{'U':>{COLUMN}}"]
    for name, *values in zip(names, found.change, found.uncertainty, strict=True):
        lines.append(f"{name:<{TITLE}}" + "".join(f"{x:{COLUMN}.4f}" for x in values))
    return "\n".join(
        [*lines, "", *verdict_lines(found.assessment, BY_SIMPLE_ACCEPTANCE)]
    )
