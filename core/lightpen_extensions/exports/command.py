"""``lightpen export``: a calibration in the formats of other programs."""

import argparse
from dataclasses import fields, replace
from pathlib import Path

from lightpen.archive.logbook import with_entry
from lightpen.commands.console import are_same, printing, shown
from lightpen.errors import UsageError
from lightpen.formats.files import write_whole
from lightpen.local_time import local_now
from lightpen.messages import printable
from lightpen.model.names import PLACES, Laboratory, is_country
from lightpen.record.calibrations import read_calibration, with_status
from lightpen_extensions.exports.formats import FORMATS

LABORATORY = {
    "laboratory": "name of the laboratory",
    "email": "its e-mail address",
    "city": "its city",
    "country": "its country, two letters such as DE",
}
MORE_OF_IT = {
    "street": "its street",
    "post-code": "its post code",
    "procedure": "its working instruction",
}
BY_NAME = {each.name: each for each in FORMATS}


def add_export(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen export``."""
    parser.set_defaults(run=_export)
    parser.add_argument(
        "result",
        type=Path,
        metavar="RESULT.json",
        help="accepted result, or record written by calibrate --json",
    )
    parser.add_argument("out", type=Path, metavar="FILE", help="file to write")
    parser.add_argument(
        "--for",
        dest="format",
        choices=BY_NAME,
        required=True,
        help="; ".join(f"{each.name}: {each.description}" for each in FORMATS),
    )
    parser.add_argument(
        "--anyway",
        action="store_true",
        help="export a retired or overdue tip in a format that cannot state it, too",
    )
    parser.add_argument(
        "--place",
        choices=PLACES,
        default="",
        help=f"for dcc: where it was calibrated ({PLACES[0]})",
    )
    for name, help_text in (LABORATORY | MORE_OF_IT).items():
        parser.add_argument(
            f"--{name}", default="", metavar="TEXT", help=f"for dcc: {help_text}"
        )


def _laboratory(options: argparse.Namespace) -> Laboratory:
    """Return the laboratory of the options; refuse one with gaps."""
    names = [item.name for item in fields(Laboratory)]
    given = {name: getattr(options, name, "").strip() for name in names}
    given["name"] = options.laboratory.strip()
    chosen = {name: text for name, text in given.items() if text}
    laboratory = replace(Laboratory(), **chosen)
    missing = [
        f"--{option}"
        for option, name in zip(LABORATORY, names, strict=False)
        if not getattr(laboratory, name)
    ]
    if missing:
        raise UsageError("cli.laboratory-missing", options=", ".join(missing))
    if not is_country(laboratory.country):
        country = printable(laboratory.country)
        raise UsageError("cli.no-country", country=country)
    return laboratory


@printing
def _export(options: argparse.Namespace) -> None:
    if are_same(options.result, options.out):
        raise UsageError("cli.export-over-result", out=options.out)
    written = BY_NAME[options.format]
    laboratory = _laboratory(options) if written.needs_laboratory else None
    file = with_entry(with_status(read_calibration(options.result), local_now()))
    if file.library_status and not (written.has_status or options.anyway):
        status = ", ".join(file.library_status)
        raise UsageError(
            "cli.export-without-status", status=status, format=written.name
        )
    content = written.content(file, laboratory)
    write_whole(options.out, content)
    print(shown(f"The tip is in {options.out}."))
