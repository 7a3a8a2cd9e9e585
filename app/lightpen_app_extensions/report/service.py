"""Results on paper, for the window."""

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.face import ReportPrinter, Service

if TYPE_CHECKING:
    from lightpen_app.work.chosen_files import SavePlace


class ReportService(Service):
    """Shows reports for the steps Review and History."""

    @override
    def report_printer(self, place: "SavePlace", page: QWidget) -> ReportPrinter:
        # Printing takes long to be imported.
        from lightpen_app_extensions.report.control import PrintReportControl

        return PrintReportControl(place, page)
