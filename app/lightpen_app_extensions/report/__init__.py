"""Results on paper: as PDF, printed, or shown page by page."""

from lightpen.extension import Extension, Subcommand
from lightpen_app.faced import Face, Faced


def _load() -> "Face":
    from lightpen_app_extensions.report.service import ReportService

    return ReportService


REPORT = Faced(
    Extension(
        "report",
        commands=(
            Subcommand(
                "report",
                "write the calibration report as PDF",
                "lightpen_app_extensions.report.command:add_report",
            ),
        ),
    ),
    _load,
)
