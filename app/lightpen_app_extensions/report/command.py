"""``lightpen report``: the report of a result as PDF."""

import argparse
import os
import sys
from pathlib import Path

from lightpen.commands.console import are_same, printing, shown
from lightpen.errors import UsageError
from lightpen.formats.files import write_whole
from lightpen.record.exports import save_new
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
    if options.out is not None and are_same(options.result, options.out):
        raise UsageError("cli.report-over-result", out=options.out)
    path = write_report(options.result, options.out, options.language)
    print(shown(f"The record is in {path}."))


def write_report(result: Path, out: Path | None, language: str) -> Path:
    """Write the report of a calibration or a verification as PDF; return its file.

    By default the report has a name of its own in the current folder. Raises what
    `read_content` does.
    """
    # Printing takes long to be imported.
    from lightpen_app.application import has_display, make_application
    from lightpen_app.look.languages import LanguageSwitch
    from lightpen_app.look.theme import load_fonts
    from lightpen_app.work.settings import Settings, settings_file
    from lightpen_app_extensions.report.content import print_report_of, read_content
    from lightpen_app_extensions.report.pages import pdf_of

    # The laboratory was named in the window.
    content = read_content(result, Settings(settings_file()).last().laboratory)
    if not has_display():
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    application = make_application(sys.argv[:1])
    switch = LanguageSwitch(application)
    switch.set_language(language)
    load_fonts()
    pdf = pdf_of(print_report_of(content))
    if out is None:
        return save_new(Path(), f"{content.stem}.pdf", pdf)
    write_whole(out, pdf)
    return out
