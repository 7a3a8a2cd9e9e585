"""Stray light: what stays bright while the pen is covered is found and masked."""

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGridLayout, QGroupBox, QVBoxLayout, QWidget

from lightpen.arrays import FloatArray
from lightpen.detection.inspection import SEARCHED_IMAGES, StraySearch
from lightpen.live.looking import LiveImage
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.translated import Translated


class StrayLightPanel(Translated, QGroupBox):
    """Searches the live images, and asks for a mask.

    Signals
    -------
    found_changed()
        `found` is different.
    mask_requested(array)
        Circles (M, 3) to leave out besides those that are: x, y and radius, px.
    clear_requested()
        Leave nothing out any more.
    cover_requested(bool)
        The simulated operator is to cover the LEDs, or to uncover them.
    drawing_toggled(bool)
        The mask is to be drawn on the image, or no longer.
    """

    found_changed = Signal()
    mask_requested = Signal(object)
    clear_requested = Signal()
    cover_requested = Signal(bool)
    drawing_toggled = Signal(bool)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._search: StraySearch | None = None
        self._knows_pen = False
        self._n_masked = 0
        self._is_live = False
        self._found: FloatArray = StraySearch().circles()

        # Widgets
        self._task = text_label(TextSize.BODY)
        self._cover = PushButton()
        self._cover.setCheckable(True)
        self._start = PushButton()
        self._mask = PushButton()
        self._clear = PushButton()
        self._draw = PushButton()
        self._draw.setCheckable(True)
        self._outcome = SignLabel()

        # Layout
        buttons = QGridLayout()
        buttons.setSpacing(GRID)
        buttons.addWidget(self._start, 0, 0)
        buttons.addWidget(self._cover, 0, 1)
        buttons.addWidget(self._mask, 1, 0)
        buttons.addWidget(self._clear, 1, 1)
        buttons.addWidget(self._draw, 2, 0, 1, 2)
        buttons.setColumnStretch(0, 1)
        buttons.setColumnStretch(1, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._task)
        layout.addLayout(buttons)
        layout.addWidget(self._outcome)

        # Connections
        self._cover.toggled.connect(self._on_cover_toggled)
        self._start.clicked.connect(self._on_start_clicked)
        self._mask.clicked.connect(self._on_mask_clicked)
        self._clear.clicked.connect(self.clear_requested)
        self._draw.toggled.connect(self.drawing_toggled)

        self._retranslate()

    def found(self) -> FloatArray:
        """Return the circles (M, 3) that were found and are not masked yet, px."""
        return self._found

    def outcome(self) -> SignLabel:
        """Return the label of what the search has come to."""
        return self._outcome

    def set_n_masked(self, n_masked: int) -> None:
        """Say how many circles are left out now."""
        if n_masked != self._n_masked:
            self._n_masked = n_masked
            self._refresh()

    def set_live(self, is_live: bool) -> None:
        """Say whether images come; a search without them is given up."""
        if is_live == self._is_live:
            return
        self._is_live = is_live
        if not is_live:
            self.give_up()
        self._refresh()

    def set_has_operator(self, has_operator: bool) -> None:
        """Offer that the simulated operator covers the LEDs, or not."""
        self._cover.setVisible(has_operator)

    @property
    def is_drawing(self) -> bool:
        """Whether the mask is drawn on the image now."""
        return self._draw.isChecked()

    def end_drawing(self) -> None:
        """Let the mask be drawn no longer."""
        self._draw.setChecked(False)

    def uncover(self) -> None:
        """Let the simulated operator uncover the LEDs, if he covers them."""
        self._cover.setChecked(False)

    def feed(self, seen: LiveImage) -> None:
        """Take part of an image for the search that is on, if one is."""
        search = self._search
        if search is None or search.is_over:
            return
        sighting = seen.sighting
        self._knows_pen = sighting is not None
        shows_pen = sighting is not None and sighting.has_pose
        self._search = search.after(seen.spots, shows_pen=shows_pen)
        if self._search.is_over:
            self._set_found(self._search.circles())
        self._refresh()

    def give_up(self) -> None:
        """Forget the search and what it found."""
        self._search = None
        self._set_found(StraySearch().circles())
        self._refresh()

    def _set_found(self, circles: FloatArray) -> None:
        if not np.array_equal(circles, self._found):
            self._found = circles
            self.found_changed.emit()

    def _on_cover_toggled(self, covers: bool) -> None:
        self._refresh()
        self.cover_requested.emit(covers)

    def _on_start_clicked(self) -> None:
        self.give_up()
        self._search = StraySearch()
        self._refresh()

    def _on_mask_clicked(self) -> None:
        circles = self._found
        self.give_up()
        self.mask_requested.emit(circles)

    def _retranslate(self) -> None:
        self.setTitle(self.tr("Stray light"))
        self._task.setText(self.tr("Cover the pen, then search for what still shines."))
        self._start.setText(self.tr("Search"))
        self._clear.setText(self.tr("Clear the mask"))
        self._draw.setText(self.tr("Draw the mask on the image"))
        self._draw.setToolTip(
            self.tr(
                "Click a spot to mask it, draw a circle with the button held down, or "
                "click into a circle to take it away."
            )
        )
        self._refresh()

    def _refresh(self) -> None:
        n_found = len(self._found)
        covers = self._cover.isChecked()
        self._cover.setText(
            self.tr("Uncover the LEDs") if covers else self.tr("Cover the LEDs")
        )
        self._cover.setToolTip(self.tr("The simulated operator does it."))
        self._mask.setText(
            self.tr("Mask the spots: {0}").format(n_found)
            if n_found
            else self.tr("Mask the spots")
        )
        is_searching = self._search is not None and not self._search.is_over
        why_not_start = ""
        if not self._is_live:
            why_not_start = self.tr("No images come.")
        elif is_searching:
            why_not_start = self.tr("The search is on.")
        self._start.set_why_not(why_not_start)
        self._mask.set_why_not("" if n_found else self.tr("Nothing was found to mask."))
        self._clear.set_why_not("" if self._n_masked else self.tr("Nothing is masked."))
        self._outcome.set_value(self._told())

    def _told(self) -> Remark:
        search, n_found = self._search, len(self._found)
        if search is None:
            if not self._n_masked:
                return Remark()
            words = self.tr("Masked places: {0}").format(self._n_masked)
            return Remark(words, Sign.CHECK, Tone.GOOD)
        if not search.is_over:
            words = self.tr("Searching: image {0} of {1}")
            n_images = len(search.images)
            return Remark(
                words.format(n_images, SEARCHED_IMAGES), Sign.WAIT, Tone.ACTIVE
            )
        if search.shows_pen:
            words = self.tr(
                "The pen is still seen. Cover all of its LEDs, then search again. "
                "Nothing is masked."
            )
            return Remark(words, Sign.WARNING, Tone.WARN)
        if not n_found and not search.is_dark:
            words = self.tr(
                "What shines moves, so it is no stray light. Cover the pen, then "
                "search again."
            )
            return Remark(words, Sign.WARNING, Tone.WARN)
        if not n_found:
            words = self.tr("No stray light: nothing bright is left.")
            return Remark(words, Sign.CHECK, Tone.GOOD)
        if self._knows_pen:
            words = self.tr("Stray spots: {0}. Mask them, or take their cause away.")
        else:
            words = self.tr(
                "Bright spots: {0}. Is the pen covered? Without its LED file it cannot "
                "be told from stray light."
            )
        return Remark(words.format(n_found), Sign.WARNING, Tone.WARN)
