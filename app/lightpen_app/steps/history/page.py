"""The step History: the complete history of pens and tips."""

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.face import Services
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.widgets.controls import LazyWidget
from lightpen_app.widgets.fitting import PageScroll, ShrinkingScrollContent
from lightpen_app.widgets.page import MainAction, Page
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from lightpen.archive.checks import ArchiveCheckResult
    from lightpen_app.steps.history.content import HistoryContent


class HistoryPage(Page):
    """The step History."""

    key = "history"

    def __init__(self, workbench: Workbench, services: Services = ()) -> None:
        super().__init__()
        self._workbench, self._services = workbench, services
        self._run = workbench.run

        # Widgets
        self._content: LazyWidget[HistoryContent] = LazyWidget(self._make_content)
        scroll = PageScroll()
        scroll.setWidget(ShrinkingScrollContent(self._content))

        # Layout
        vertical_layout(self, scroll)

        self._retranslate()

    @override
    def lead(self) -> str:
        return self.tr("Complete, tamper-evident history of every tip")

    @override
    def is_complete(self) -> bool:
        """Return whether the present swing is in the archive, or that was checked."""
        return self._run.status.result is not None or self._check_result() is not None

    @override
    def is_doubtful(self) -> bool:
        checked = self._check_result()
        return checked is not None and bool(checked.findings)

    @override
    def main_action(self) -> MainAction:
        return MainAction(self.tr("Next calibration"))

    @override
    def run_main_action(self) -> None:
        self.step_requested.emit("start")

    @override
    def first_control(self) -> QWidget:
        return self._content.content().table

    @override
    def entered(self) -> None:
        self._content.content().read_anew()

    @override
    def shut_down(self) -> None:
        content = self._content.content_so_far()
        if content is not None:
            content.shut_down()

    @override
    def _retranslate(self) -> None:
        self.changed.emit()

    def _make_content(self) -> "HistoryContent":
        # Imported here: with the archive it takes 0.25 s.
        from lightpen_app.steps.history.content import HistoryContent

        content = HistoryContent(self._workbench, self._services)

        # Connections
        content.checked.connect(self.changed)
        return content

    def _check_result(self) -> "ArchiveCheckResult | None":
        content = self._content.content_so_far()
        return None if content is None else content.check_result()
