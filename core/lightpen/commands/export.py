"""``lightpen export``: a tip as other programs read it."""

import argparse
import re
from pathlib import Path

from lightpen.commands.console import are_same, printing, shown
from lightpen.errors import UsageError
from lightpen.formats.files import printable, write_whole
from lightpen.record.calibrations import read_calibration
from lightpen.record.dcc import Laboratory, dcc_text
from lightpen.record.interchange import TEXT_OF
from lightpen.record.statement import read_statement
from lightpen.sentences import sentence

CERTIFICATE = "dcc"
LABORATORY = {
    "laboratory": "who calibrated",
    "email": "of who calibrated",
    "city": "where that is",
    "country": "where that is, two letters such as DE",
}
COUNTRY = re.compile("[A-Z]{2}")


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
        choices=(*TEXT_OF, CERTIFICATE),
        required=True,
        help="who reads it: 3D Slicer (.tfm), PLUS, ROS (.yaml), Q-DAS (.dfq); or as "
        "plain text, a table, or PTB's Digital Calibration Certificate (.xml)",
    )
    for name, told in LABORATORY.items():
        parser.add_argument(
            f"--{name}", default="", metavar="TEXT", help=f"for dcc: {told}"
        )


def _text(options: argparse.Namespace) -> str:
    if options.reader != CERTIFICATE:
        return TEXT_OF[options.reader](read_calibration(options.result))
    missing = [f"--{name}" for name in LABORATORY if not getattr(options, name).strip()]
    if missing:
        raise UsageError(
            sentence(
                "cli.laboratory-missing",
                "A Digital Calibration Certificate names who calibrated: {options} "
                "are missing. Give each.",
                options=", ".join(missing),
            )
        )
    if not COUNTRY.fullmatch(options.country):
        raise UsageError(
            sentence(
                "cli.no-country",
                "{country} is no code of a country. Give two capital letters as in "
                "ISO 3166-1, such as DE.",
                country=printable(options.country),
            )
        )
    laboratory = Laboratory(
        options.laboratory, options.email, options.city, options.country
    )
    return dcc_text(read_statement(options.result), laboratory)


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
    text = _text(options)
    write_whole(options.out, text.encode("utf-8", "backslashreplace"))
    print(shown(f"The tip is in {options.out}."))
