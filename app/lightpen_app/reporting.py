"""The record on paper of a calibration, without a window."""

import os
import sys
from pathlib import Path

from lightpen.formats.files import write_whole
from lightpen.record.exports.exports import save_new
from lightpen_app.application import has_display, make_application
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.theme import load_fonts
from lightpen_app.print_report.control import read_calibration_file
from lightpen_app.print_report.printing import paper_of, paper_stem, pdf_of


def write_paper(result: Path, out: Path | None, language: str) -> Path:
    """Write the record on paper of a calibration as PDF.

    Parameters
    ----------
    result : Path
        An accepted result, or what ``lightpen calibrate`` wrote.
    out : Path or None
        Output file; None for a default name in the current folder.

    Returns
    -------
    Path
        Where it is.

    Raises
    ------
    ArchiveError
        The archive beside it cannot be read.
    FileError
        The calibration cannot be read, or the PDF not be written.
    UsageError
        The file holds no calibration, or not all that is put on paper.
    """
    found = read_calibration_file(result)
    if not has_display():
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    application = make_application(sys.argv[:1])
    languages = LanguageSwitch(application)
    languages.set_language(language)
    load_fonts()
    pdf = pdf_of(paper_of(found.calibration_file, found.reestimated, found.entered))
    if out is None:
        return save_new(Path(), f"{paper_stem(found.calibration_file)}.pdf", pdf)
    write_whole(out, pdf)
    return out
