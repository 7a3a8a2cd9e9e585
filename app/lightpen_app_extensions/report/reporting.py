"""The report of a calibration or a verification, without a window."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lightpen.formats.files import A_FILE, LARGEST_RECORD, read_bytes, write_whole
from lightpen.model.names import Laboratory
from lightpen.record.exports import save_new
from lightpen.record.folder import is_verification
from lightpen_app.application import has_display, make_application
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.theme import load_fonts
from lightpen_app.work.settings import Settings, settings_file
from lightpen_app_extensions.report.control import (
    read_calibration_file,
    read_kept_verification,
)
from lightpen_app_extensions.report.pages import pdf_of, print_report_of, report_stem


def write_report(result: Path, out: Path | None, language: str) -> Path:
    """Write the report of a calibration or a verification as PDF; return its file.

    The result is an accepted one, or what ``lightpen calibrate``, ``verify`` or
    ``repeatability`` wrote; a file that lacks content of the report is refused. By
    default the report has a name of its own in the current folder.
    """
    if is_verification(read_bytes(result, A_FILE, LARGEST_RECORD)):
        return _write_verification(result, out, language)
    found = read_calibration_file(result)
    with _application_in(language):
        content = found.calibration_file, found.reestimated, found.entered
        pdf = pdf_of(print_report_of(*content, _laboratory()))
    return _written(pdf, report_stem(found.calibration_file), out)


def _write_verification(file: Path, out: Path | None, language: str) -> Path:
    # Few reports are of one.
    from lightpen_app_extensions.report.verification import (
        verification_print_report,
        verification_stem,
    )

    found = read_kept_verification(file)
    with _application_in(language):
        pdf = pdf_of(verification_print_report(*found, _laboratory()))
    return _written(pdf, verification_stem(file, found.done), out)


def _laboratory() -> Laboratory | None:
    """Return the laboratory that was named in the window, or of this computer."""
    return Settings(settings_file()).laboratory()


@contextmanager
def _application_in(language: str) -> Iterator[None]:
    """Have an application, without a display if need be, in a language."""
    if not has_display():
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    application = make_application(sys.argv[:1])
    languages = LanguageSwitch(application)
    languages.set_language(language)
    load_fonts()
    yield


def _written(pdf: bytes, stem: str, out: Path | None) -> Path:
    if out is None:
        return save_new(Path(), f"{stem}.pdf", pdf)
    write_whole(out, pdf)
    return out
