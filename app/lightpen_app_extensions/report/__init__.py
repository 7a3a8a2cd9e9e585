"""Results on paper: as PDF, printed, or shown page by page."""

from argparse import ArgumentParser

from lightpen.extension import Extension, Subcommand
from lightpen_app.faced import Face, Faced


def _add_report(parser: ArgumentParser) -> None:
    from lightpen_app_extensions.report.command import add_report

    add_report(parser)


def _load() -> "Face":
    from lightpen_app_extensions.report.control import ReportService

    return ReportService


REPORT = Faced(
    Extension(
        "report",
        commands=(
            Subcommand("report", "write the calibration report as PDF", _add_report),
        ),
    ),
    _load,
)
