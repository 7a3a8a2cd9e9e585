"""The panels of the step Camera, arranged about the live image."""

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.face import Services
from lightpen_app.look.layouts import grid_layout, horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.camera.exposure_panel import ExposurePanel, FocusPanel
from lightpen_app.steps.camera.intrinsics_panel import IntrinsicsPanel
from lightpen_app.steps.camera.live_panel import LivePanel
from lightpen_app.steps.camera.rig_panel import RigPanel
from lightpen_app.steps.camera.settings_panel import SettingsPanel
from lightpen_app.steps.camera.source_panel import (
    BesideControl,
    SourcePanel,
    SourceSearch,
)
from lightpen_app.steps.camera.stray_light_panel import StrayLightPanel
from lightpen_app.widgets.fitting import PageScroll, ResponsiveLayout
from lightpen_app.widgets.state_banner import SignLabel
from lightpen_app.work.workbench import Workbench

SIDE_WIDTH, NARROW_SIDE_WIDTH = 50 * GRID, 46 * GRID


class CameraPanels(ResponsiveLayout, QWidget):
    """Holds the panels; each is public."""

    narrow_below = 120 * GRID  # px; then it has its panels all at the side

    def __init__(self, workbench: Workbench, services: Services = ()) -> None:
        super().__init__()

        # Widgets
        chosen, files = workbench.selection, workbench.files
        camera, live = workbench.camera, workbench.live
        self.swing_message = SignLabel()
        self.source = SourcePanel(camera.sources)
        self.second = SourcePanel(camera.sources, is_second=True)
        self.rig = RigPanel(chosen, camera, files, self.second)
        self.settings = SettingsPanel()
        self.intrinsics = IntrinsicsPanel(chosen, services)
        self.images = LivePanel()
        self.stray_light = StrayLightPanel(chosen, live, self.images)
        self.exposure = ExposurePanel(live)
        self.focus = FocusPanel()
        self._search = SourceSearch(camera, self.source, self.second)
        self.beside = BesideControl(chosen, files, self.source)

        # Layout
        side = QWidget()
        self._panels = vertical_layout(
            side,
            self.swing_message,
            self.source,
            self.settings,
            self.intrinsics,
            self.rig,
            self.second,
            self.stray_light,
            1,
            spacing=2 * GRID,
        )
        self._side = scroll = PageScroll()
        scroll.setWidget(side)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._grid = layout = grid_layout(self, spacing=-1)
        layout.addWidget(self.images, 0, 0)
        self._foot = horizontal_layout(layout, at=(1, 0), spacing=2 * GRID)
        self._use_room()  # before the side: the order of the Tab key
        layout.addWidget(scroll, 0, 1, 2, 1)
        layout.setRowStretch(0, 1)
        layout.setColumnStretch(0, 1)

    def reveal_stray_light(self) -> None:
        """Scroll to the search for stray light."""
        panel, show = self.stray_light, self._side.ensureWidgetVisible
        QTimer.singleShot(0, panel, lambda: show(panel, 0, 0))  # once it has grown

    @override
    def _use_room(self) -> None:
        """Put exposure and focus below the image, or at the side of a narrow page."""
        is_narrow = self._room.is_narrow
        if is_narrow:
            self._panels.insertWidget(0, self.exposure)
            self._panels.insertWidget(1, self.focus)
        else:
            self._foot.addWidget(self.exposure, 3)
            self._foot.addWidget(self.focus, 2)
        self._grid.setHorizontalSpacing(2 * GRID if is_narrow else 3 * GRID)
        # The layout spaces out an empty foot, too.
        self._grid.setVerticalSpacing(0 if is_narrow else 2 * GRID)
        self._side.setFixedWidth(NARROW_SIDE_WIDTH if is_narrow else SIDE_WIDTH)
