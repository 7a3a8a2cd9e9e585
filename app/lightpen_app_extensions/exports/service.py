"""Tips for other programs in the window."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.model.names import Laboratory
from lightpen_app.face import Service
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from lightpen.record.exports import ExportFormat


class ExportsService(Service):
    """Adds formats to the menu of the step Review that saves results."""

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self._settings = workbench.settings

    @override
    def ask_laboratory(
        self, page: QWidget, then: Callable[[Laboratory], object]
    ) -> None:
        from lightpen_app_extensions.exports.laboratory_dialog import LaboratoryDialog

        dialog = LaboratoryDialog(self._settings.last().laboratory, page)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.given.connect(lambda given: self._settings.set_last(laboratory=given))
        dialog.given.connect(then)
        dialog.open()

    @override
    def export_formats(self) -> "tuple[ExportFormat, ...]":
        # It takes long to be imported.
        from lightpen_extensions.exports.formats import MORE_FORMATS

        return MORE_FORMATS
