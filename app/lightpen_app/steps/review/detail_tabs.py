"""The details of a solved swing: images and plots, each in a tab."""

from itertools import chain
from typing import TYPE_CHECKING

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QTabWidget

from lightpen_app.widgets.lazy import LazyWidget
from lightpen_app.widgets.page_scroll import PageScroll, ShrinkingScrollContent
from lightpen_app.work.save_place import SavePlace
from lightpen_app.work.swing_run import SwingRun

if TYPE_CHECKING:
    from lightpen_app.steps.review.images_panel import ImagesPanel
    from lightpen_app.steps.review.plot_card import NamedPicture
    from lightpen_app.steps.review.plots_panel import PlotsPanel


class DetailTabs(QTabWidget):
    """Shows the solution of a swing; hidden tabs are filled when they are shown."""

    # ImagesPanel: the tab of the images is seen for the first time
    images_made = Signal(object)
    # MethodsPanel: the tab of the methods is seen for the first time
    methods_made = Signal(object)
    # Message on a saved plot, or on a failure to save it.
    saved = Signal(str)
    failed = Signal(str)

    def __init__(self, run: SwingRun, place: SavePlace) -> None:
        super().__init__()
        self._run = run
        self._place = place
        self._images = LazyWidget(_make_images_panel)
        self._residuals = LazyWidget(_make_residuals_panel)
        self._methods: LazyWidget[PlotsPanel] = LazyWidget(_make_methods_panel)
        self._panels: tuple[LazyWidget[ImagesPanel] | LazyWidget[PlotsPanel], ...] = (
            self._images,
            self._residuals,
            LazyWidget(_make_uncertainty_panel),
            self._methods,
        )
        self._tab_of = {panel: PageScroll() for panel in self._panels}
        for panel, tab in self._tab_of.items():
            tab.setWidget(ShrinkingScrollContent(panel))
            self.addTab(tab, "")

        # Connections
        self._images.made.connect(self.images_made)
        self._methods.made.connect(self.methods_made)
        for panel in self._panels:
            panel.made.connect(self._on_panel_made)
        self.currentChanged.connect(self.fill)

    def set_names(self, images: str, residuals: str, u: str, methods: str) -> None:
        """Set the titles of the tabs."""
        names = images, residuals, u, methods
        for tab, name in zip(self._tab_of.values(), names, strict=True):
            self.setTabText(self.indexOf(tab), name)

    def images(self) -> "ImagesPanel | None":
        """Return the images, once they were seen."""
        return self._images.content_so_far()

    def fill(self) -> None:
        """Show the solution in the visible tab, or residuals without a solution."""
        has_failed = self._run.status.failure is not None
        residuals = self._tab_of[self._residuals]
        for tab in self._tab_of.values():
            self.setTabEnabled(self.indexOf(tab), tab is residuals or not has_failed)
        if has_failed:
            self.setCurrentWidget(residuals)
        for panel, tab in self._tab_of.items():
            if tab is self.currentWidget():
                self._show_solution(panel.content())

    def pictures(self) -> "list[NamedPicture]":
        """Return all plots for saving, also of hidden tabs."""
        for panel, tab in self._tab_of.items():
            self._show_solution(panel.content())
            tab.resize(self.currentWidget().size())
            tab.grab()  # lays it out as if it was looked at
        cards = chain.from_iterable(panel.content().cards() for panel in self._panels)
        return [card.picture() for card in cards if card.is_needed]

    def shut_down(self) -> None:
        """Cancel running jobs."""
        for panel in self._panels:
            content = panel.content_so_far()
            if content is not None:
                content.shut_down()

    def _show_solution(self, panel: "ImagesPanel | PlotsPanel") -> None:
        solution, failure = self._run.status.solution, self._run.status.failure
        setup, residuals = self._run.status.setup, self._residuals.content_so_far()
        if panel.value() is not solution:
            limit = None if setup is None else setup.limits.max_uncertainty
            panel.set_value(solution, limit)
        if failure is not None and setup is not None and residuals is not None:
            residuals.set_failed(failure, setup.rig)

    def _on_panel_made(self, panel: "ImagesPanel | PlotsPanel") -> None:
        for card in panel.cards():
            card.set_place(self._place)
        panel.saved.connect(self.saved)
        panel.failed.connect(self.failed)


# Imported here: plots take a fifth of the start time, and the first window has none.


def _make_images_panel() -> "ImagesPanel":
    from lightpen_app.steps.review.images_panel import ImagesPanel

    return ImagesPanel()


def _make_residuals_panel() -> "PlotsPanel":
    from lightpen_app.steps.review.plots_panel import ResidualsPanel

    return ResidualsPanel()


def _make_uncertainty_panel() -> "PlotsPanel":
    from lightpen_app.steps.review.plots_panel import UncertaintyPanel

    return UncertaintyPanel()


def _make_methods_panel() -> "PlotsPanel":
    from lightpen_app.steps.review.plots_panel import MethodsPanel

    return MethodsPanel()
