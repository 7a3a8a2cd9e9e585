"""Stray light: search for bright spots with the pen covered, and masking."""

import numpy as np
from PySide6.QtWidgets import QGroupBox

from lightpen.arrays import FloatArray
from lightpen.detection.inspection import SEARCHED_IMAGES, StraySearch
from lightpen.live.pipeline import LiveImage
from lightpen_app.look.layouts import grid_layout, vertical_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import TextSize, Tone, text_label
from lightpen_app.steps.camera.live_panel import LivePanel
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.live_markers import mask_markers, stray_markers
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.live_view import LiveView
from lightpen_app.work.selection import Selection


class StrayLightPanel(Translated, QGroupBox):
    """Searches the live images, and masks what is found."""

    def __init__(self, selection: Selection, live: LiveView, images: LivePanel) -> None:
        super().__init__()
        self.say(self, self.tr("Stray light"))
        self._selection, self._live, self._images = selection, live, images
        self._search: StraySearch | None = None
        self._knows_pen = False
        self._is_live = False
        self._found: FloatArray = StraySearch().circles()

        # Widgets
        self._task = self.say(
            text_label(TextSize.BODY),
            self.tr("Cover the pen, then search for stray light."),
        )
        self._start = self.make_button(self.tr("Search"), self._on_start_clicked)
        self._mask = PushButton()
        self._clear = self.make_button(
            self.tr("Clear mask"), lambda: self._set_mask(np.zeros((0, 3)))
        )
        self._outcome = SignLabel()

        # Layout
        layout = vertical_layout(self, self._task)
        buttons = grid_layout(layout)
        buttons.addWidget(self._start, 0, 0)
        buttons.addWidget(self._mask, 1, 0)
        buttons.addWidget(self._clear, 1, 1)
        buttons.setColumnStretch(0, 1)
        buttons.setColumnStretch(1, 1)
        layout.addWidget(self._outcome)

        # Connections
        self._mask.clicked.connect(self._on_mask_clicked)

        self._refresh()

    def outcome(self) -> SignLabel:
        """Return the label with the result of the search."""
        return self._outcome

    def show_mask(self) -> None:
        """Show masked circles and the stray light found."""
        masked = mask_markers(self._masked)
        found = stray_markers(self._found, self.tr("stray"))
        self._images.set_extra_markers((*masked, *found))
        self._refresh()

    @property
    def _masked(self) -> FloatArray:
        """Stray light in the images that are shown, (M, 3), px."""
        return self._selection.preparation.mask_of(self._live.chosen)

    def _set_mask(self, mask: FloatArray) -> None:
        now = self._selection.preparation
        self._selection.set_preparation(now.with_mask(self._live.chosen, mask))

    def set_live(self, is_live: bool) -> None:
        """Show whether images arrive; without them a search is cancelled."""
        if is_live == self._is_live:
            return
        self._is_live = is_live
        if not is_live:
            self.give_up()
        self._refresh()

    def feed(self, seen: LiveImage) -> None:
        """Pass an image to the search, if one is in progress."""
        search = self._search
        if search is None or search.is_over:
            return
        detection = seen.detection
        self._knows_pen = detection is not None
        shows_pen = detection is not None and detection.has_pose
        self._search = search.after(seen.spots, shows_pen=shows_pen)
        if self._search.is_over:
            self._set_found(self._search.circles())
        self._refresh()

    def give_up(self) -> None:
        """Cancel the search and discard its result."""
        self._search = None
        self._set_found(StraySearch().circles())
        self._refresh()

    def _set_found(self, circles: FloatArray) -> None:
        if not np.array_equal(circles, self._found):
            self._found = circles
            self.show_mask()

    def _on_start_clicked(self) -> None:
        self.give_up()
        self._search = StraySearch()
        self._refresh()

    def _on_mask_clicked(self) -> None:
        circles = self._found
        self.give_up()
        self._set_mask(np.concatenate([self._masked, circles]))

    def _refresh(self) -> None:
        n_found = len(self._found)
        self._mask.setText(
            self.tr("Mask the spots: {0}").format(n_found)
            if n_found
            else self.tr("Mask the spots")
        )
        is_searching = self._search is not None and not self._search.is_over
        why_not_start = ""
        if not self._is_live:
            why_not_start = self.tr("No images are received.")
        elif is_searching:
            why_not_start = self.tr("Search in progress")
        self._start.set_why_not(why_not_start)
        self._mask.set_why_not("" if n_found else self.tr("No spots to mask"))
        n_masked = len(self._masked)
        self._clear.set_why_not("" if n_masked else self.tr("No mask is set."))
        self._outcome.set_value(self._outcome_message(n_masked))

    def _outcome_message(self, n_masked: int) -> StatusMessage:
        search, n_found = self._search, len(self._found)
        if search is None:
            if not n_masked:
                return StatusMessage()
            words = self.tr("Masked areas: {0}").format(n_masked)
            return StatusMessage.good(words)
        if not search.is_over:
            words = self.tr("Searching: image {0} of {1}")
            n_images = len(search.images)
            return StatusMessage(
                words.format(n_images, SEARCHED_IMAGES), Sign.WAIT, Tone.ACTIVE
            )
        if search.shows_pen:
            words = self.tr(
                "The pen is still visible; nothing was masked. Cover all LEDs, then "
                "search again."
            )
            return StatusMessage.warning(words)
        if not n_found and not search.is_dark:
            words = self.tr(
                "The bright spots move and are not stray light. Cover the pen, then "
                "search again."
            )
            return StatusMessage.warning(words)
        if not n_found:
            return StatusMessage.good(self.tr("No stray light found."))
        if self._knows_pen:
            words = self.tr("Stray spots: {0}. Mask them or remove their source.")
        else:
            words = self.tr(
                "Bright spots: {0}. Is the pen covered? Without its LED file, LEDs "
                "cannot be distinguished from stray light."
            )
        return StatusMessage.warning(words.format(n_found))
