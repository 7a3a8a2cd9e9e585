"""Print every figure of speed and accuracy beside its limit and what others reach.

Usage: python benchmarks/run.py [--update-docs] [SECTION ...]

Figures on the image sets need LIGHTPEN_DATA. Nothing else should run meanwhile: the
sections `hostile`, `archive`, `soak` and `events` take from ten minutes to an hour, all
others together some thirty minutes. Exit status 1 if a limit is missed.
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.archive import archive_rows
from benchmarks.camera_calibrations import camera_calibration_rows
from benchmarks.cramer_rao import cramer_rao_rows
from benchmarks.discoveries import discovery_rows
from benchmarks.guided import guided_rows
from benchmarks.hard_scene import hard_scene_rows
from benchmarks.hostile_files import hostile_file_rows
from benchmarks.hostile_kills import hostile_kill_rows
from benchmarks.hostile_records import hostile_record_rows
from benchmarks.image_sets import data_folder
from benchmarks.killed import killed_rows
from benchmarks.labelling import labelling_rows
from benchmarks.machine import description
from benchmarks.parts import part_rows
from benchmarks.plant_view import plant_view_rows
from benchmarks.published import with_section
from benchmarks.rows import NEEDS_DATA, Row, table
from benchmarks.small_leds import small_led_rows
from benchmarks.speed import speed_rows
from benchmarks.station import station_rows
from benchmarks.tips import repeat_rows, tip_rows
from benchmarks.tracker import tracker_rows
from benchmarks.verification import verification_rows
from benchmarks.verification_sessions import pen_rows, session_rows
from benchmarks.whole_program import program_rows
from benchmarks.wizard import event_rows, idle_rows, link_rows, soak_rows, start_rows
from benchmarks.workers import Workers, one_core_workers
from benchmarks.wrong_files import wrong_file_rows

FIGURES = Path(__file__).resolve().parents[1] / "docs" / "benchmark.md"

Section = Callable[[Workers, Path | None], list[Row]]

SECTIONS: dict[str, Section] = {
    "tips": tip_rows,
    "repeat": repeat_rows,
    "bound": lambda workers, data: cramer_rao_rows(workers),
    "files": lambda workers, data: wrong_file_rows(workers),
    "station": lambda workers, data: station_rows(workers),
    "cameras": camera_calibration_rows,
    "discover": lambda workers, data: discovery_rows(workers),
    "hard": lambda workers, data: hard_scene_rows(workers),
    "labels": lambda workers, data: labelling_rows(workers),
    "leds": lambda workers, data: small_led_rows(workers),
    "tracker": tracker_rows,
    "verify": verification_rows,
    "measure": lambda workers, data: part_rows(workers),
    "power": lambda workers, data: session_rows(workers),
    "pens": lambda workers, data: pen_rows(workers),
    "speed": speed_rows,
    "program": lambda workers, data: program_rows(data),
    "guided": lambda workers, data: guided_rows(workers),
    "killed": lambda workers, data: killed_rows(),
    "hostile": lambda workers, data: [
        *hostile_file_rows(),
        *hostile_record_rows(),
        *hostile_kill_rows(),
    ],
    "archive": lambda workers, data: archive_rows(),
    "view": lambda workers, data: plant_view_rows(),
    "start": lambda workers, data: start_rows(),
    "idle": lambda workers, data: idle_rows(),
    "link": lambda workers, data: link_rows(),
    "soak": lambda workers, data: soak_rows(),
    "events": lambda workers, data: event_rows(),
}


def main() -> int:
    """Measure, print the table, and return the exit status."""
    parser = argparse.ArgumentParser(
        description="Print every figure of speed and accuracy."
    )
    parser.add_argument(
        "sections", nargs="*", metavar="SECTION", help=f"of {', '.join(SECTIONS)}; all"
    )
    parser.add_argument(
        "--update-docs",
        action="store_true",
        help="put these sections into docs/benchmark.md",
    )
    options = parser.parse_args()
    unknown = set(options.sections) - set(SECTIONS)
    if unknown:
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    data = data_folder()
    if options.update_docs and data is None:
        parser.error(
            "docs/benchmark.md takes whole sections only, which need LIGHTPEN_DATA."
        )
    if data is not None and not (data / "swing-full").is_dir():
        parser.error(f"LIGHTPEN_DATA names {data}, which holds no folder swing-full.")
    rows: list[Row] = []
    with one_core_workers() as workers:
        for name in options.sections or SECTIONS:
            start = time.perf_counter()
            of_section = SECTIONS[name](workers, data)
            rows += of_section
            text = f"{description()}\n\n{table(of_section)}"
            print(f"{name}\n\n{text}\n", flush=True)
            _say(f"{name}: {time.perf_counter() - start:.0f} s")
            if options.update_docs:
                content = FIGURES.read_text(encoding="utf-8")
                renewed = with_section(content, name, text, list(SECTIONS))
                FIGURES.write_text(renewed, encoding="utf-8")
    missed = [row for row in rows if not row.met]
    n_without_data = sum(row.measured == NEEDS_DATA for row in rows)
    _say(
        f"{len(missed)} of {len(rows)} figures miss their limit; {n_without_data} "
        "need LIGHTPEN_DATA."
    )
    return 1 if missed else 0


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
