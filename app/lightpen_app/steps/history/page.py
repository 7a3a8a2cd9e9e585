"""The step History: all that ever became of a pen and its tips."""

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QVBoxLayout, QWidget
from typing_extensions import override

from lightpen_app.steps.page import MainAction, Page
from lightpen_app.widgets.late import Late
from lightpen_app.widgets.page_scroll import PageScroll, Squeezed
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from lightpen.archive.check import Checked
    from lightpen_app.steps.history.content import HistoryContent


class HistoryPage(Page):
    """The step History."""

    key = "history"

    def __init__(self, workbench: Workbench, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._workbench = workbench
        self._checked: Checked | None = None

        # Widgets
        self._content: Late[HistoryContent] = Late(self._make_content)
        scroll = PageScroll()
        scroll.setWidget(Squeezed(self._content))

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(scroll)

        self._retranslate()

    @override
    def title(self) -> str:
        return self.tr("History")

    @override
    def lead(self) -> str:
        return self.tr("All that ever became of a tip. Nothing here is ever changed.")

    @override
    def is_complete(self) -> bool:
        """Return whether the present swing is in the archive, or that was checked."""
        return self._workbench.run.status.result is not None or (
            self._checked is not None
        )

    @override
    def is_doubtful(self) -> bool:
        return self._checked is not None and bool(self._checked.findings)

    @override
    def main_action(self) -> MainAction:
        return MainAction(self.tr("Next calibration"))

    @override
    def run_main_action(self) -> None:
        self.step_requested.emit("start")

    @override
    def first_control(self) -> QWidget:
        return self._content.content().table()

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
        # With the archive, a quarter of a second that the start need not take.
        from lightpen_app.steps.history.content import HistoryContent

        content = HistoryContent(self._workbench)

        # Connections
        content.checked.connect(self._on_checked)
        content.status_changed.connect(self.status_changed)
        content.notice_raised.connect(self.notice_raised)
        return content

    def _on_checked(self, checked: "Checked") -> None:
        self._checked = checked
        self.changed.emit()
