"""``lightpen export``: a tip as other programs read it."""

import argparse
from pathlib import Path

from lightpen.commands.console import are_same, printing, shown
from lightpen.errors import UsageError
from lightpen.formats.files import write_whole
from lightpen.record.calibrations import read_calibration
from lightpen.record.interchange import TEXT_OF
from lightpen.sentences import sentence


def add_export(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen export``."""
    parser.set_defaults(run=_export)
    parser.add_argument(
        "result",
        type=Path,
        metavar="RESULT.json",
        help="an accepted result, or what calibrate --json wrote",
    )
    parser.add_argument("out", type=Path, metavar="FILE")
    parser.add_argument(
        "--for",
        dest="reader",
        choices=TEXT_OF,
        required=True,
        help="who reads it: 3D Slicer (.tfm), PLUS, ROS (.yaml), Q-DAS (.dfq); or as "
        "plain text or a table",
    )


@printing
def _export(options: argparse.Namespace) -> None:
    if are_same(options.result, options.out):
        raise UsageError(
            sentence(
                "cli.export-over-result",
                "{out} would replace the result that it is made from. Give the file "
                "another name.",
                out=str(options.out),
            )
        )
    text = TEXT_OF[options.reader](read_calibration(options.result))
    write_whole(options.out, text.encode("utf-8", "backslashreplace"))
    print(shown(f"The tip is in {options.out}."))
