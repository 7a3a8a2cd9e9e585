"""``lightpen report``: the report of a result as PDF."""

import argparse
from pathlib import Path

from lightpen.commands.console import are_same, printing, shown
from lightpen.errors import UsageError
from lightpen_resources import languages


def add_report(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen report``."""
    parser.set_defaults(run=_report)
    parser.add_argument(
        "result",
        type=Path,
        metavar="RESULT.json",
        help="accepted result or verification, or record written with --json",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE.pdf",
        help="output file (default: named by pen, tip and date, in this folder)",
    )
    known = languages()
    parser.add_argument(
        "--language",
        choices=known,
        default=known[0],
        help=f"language of the report ({known[0]})",
    )


@printing
def _report(options: argparse.Namespace) -> None:
    from lightpen_app_extensions.report.reporting import write_report

    if options.out is not None and are_same(options.result, options.out):
        raise UsageError("cli.report-over-result", out=options.out)
    path = write_report(options.result, options.out, options.language)
    print(shown(f"The record is in {path}."))
