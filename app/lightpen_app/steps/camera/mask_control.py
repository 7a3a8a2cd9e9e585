"""Stray light mask of the displayed camera: drawn or searched for."""

import numpy as np
from PySide6.QtCore import QObject

from lightpen.arrays import FloatArray
from lightpen.detection.inspection import clicked, with_circle
from lightpen_app.steps.camera.live_panel import LivePanel
from lightpen_app.steps.camera.stray_light_panel import StrayLightPanel
from lightpen_app.widgets.live_markers import mask_markers, stray_markers
from lightpen_app.work.live_view import LiveView
from lightpen_app.work.selection import Selection


class MaskControl(QObject):
    """Carries out requests of the stray-light panel and of the image."""

    def __init__(
        self,
        selection: Selection,
        live: LiveView,
        panel: StrayLightPanel,
        images: LivePanel,
    ) -> None:
        super().__init__(panel)
        self._selection, self._live = selection, live
        self._panel, self._images = panel, images

        # Connections
        panel.found_changed.connect(self.show_mask)
        panel.mask_requested.connect(self._on_mask_requested)
        panel.clear_requested.connect(self._on_clear_requested)
        panel.cover_requested.connect(self._on_cover_requested)
        panel.drawing_toggled.connect(images.view.set_draws_circles)
        images.view.pixel_clicked.connect(self._on_image_clicked)
        images.view.circle_drawn.connect(self._on_circle_drawn)

    def show_mask(self) -> None:
        """Show masked circles and the stray light found."""
        self._panel.set_n_masked(len(self._mask))
        masked = mask_markers(self._mask)
        found = stray_markers(self._panel.found(), self.tr("stray"))
        self._images.set_extra_markers((*masked, *found))

    def end(self) -> None:
        """End searching and drawing, as the step is left."""
        self._panel.give_up()
        self._panel.end_drawing()
        self._panel.uncover()

    @property
    def _mask(self) -> FloatArray:
        """Stray light in the images that are shown, (M, 3), px."""
        return self._selection.preparation.mask_of(self._live.chosen)

    def _set_mask(self, mask: FloatArray) -> None:
        now = self._selection.preparation
        self._selection.set_preparation(now.with_mask(self._live.chosen, mask))

    def _on_mask_requested(self, circles: FloatArray) -> None:
        self._set_mask(np.concatenate([self._mask, circles]))

    def _on_clear_requested(self) -> None:
        self._set_mask(np.zeros((0, 3)))

    def _on_image_clicked(self, x: float, y: float) -> None:
        spots = self._images.spots()
        if self._panel.is_drawing and spots is not None:
            self._set_mask(clicked(self._mask, spots, np.array([x, y])))

    def _on_circle_drawn(self, x: float, y: float, radius: float) -> None:
        self._set_mask(with_circle(self._mask, np.array([x, y, radius])))

    def _on_cover_requested(self, covers: bool) -> None:
        if operator := self._live.operator:
            (operator.cover if covers else operator.uncover)()
