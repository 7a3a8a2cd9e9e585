"""The step Verify: verification of the current tip without a key."""

from typing import TYPE_CHECKING

from typing_extensions import override

from lightpen_app.look.sounds import Sounds
from lightpen_app.steps.verify.presenter import VerifyPresenter
from lightpen_app.steps.verify.probing_page import ProbingPage
from lightpen_app.widgets.lazy import LazyWidget
from lightpen_app.widgets.page_scroll import PageScroll, ShrinkingScrollContent
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from lightpen_app.steps.verify.pen_panel import PenPanel


class VerifyPage(ProbingPage):
    """Shows a verification and leads it; nothing on it must be pressed meanwhile."""

    key = "verify"

    def __init__(self, workbench: Workbench, sounds: Sounds) -> None:
        run = workbench.verification
        presenter = VerifyPresenter(workbench, run)
        super().__init__(workbench, sounds, run, presenter)

        # Widgets
        self._pen: LazyWidget[PenPanel] = LazyWidget(self._make_pen_panel)
        self._pen_page = PageScroll()
        self._pen_page.setWidget(ShrinkingScrollContent(self._pen))
        self._pages.add(self._pen_page)

        self._on_workbench_changed()
        self._retranslate()

    @override
    def shut_down(self) -> None:
        super().shut_down()
        pen = self._pen.content_so_far()
        if pen is not None:
            pen.shut_down()

    @override
    def _retranslate(self) -> None:
        super()._retranslate()
        self._pages.set_title(self._pen_page, self.tr("Pen"))

    def _make_pen_panel(self) -> "PenPanel":
        # What draws its plot takes long to be imported.
        from lightpen_app.steps.verify.pen_panel import PenPanel

        return PenPanel(self._workbench)
