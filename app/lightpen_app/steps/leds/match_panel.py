"""The live image, and the match of its LEDs with the table."""

from collections import deque
from collections.abc import Iterable

import numpy as np
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QGroupBox
from typing_extensions import override

from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.pen_check.match import PenMatch
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.phrases import reason_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import TextSize, Tone
from lightpen_app.look.words import number_text
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.image_view import ImageView, Marker
from lightpen_app.widgets.live_markers import live_markers
from lightpen_app.widgets.state_banner import (
    SignLabel,
    State,
    StateBanner,
    StatusMessage,
)
from lightpen_app.work.live_view import DisplayedImage

N_SMOOTHED = 20  # images that are reported together: one second
N_FINDINGS = 4
TALLEST = 0.9  # height of the image over its width; sensors are flatter


class MatchPanel(Translated, QGroupBox):
    """Shows images with numbered LEDs and the match of each."""

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Live match"))
        self._match: PenMatch | None = None
        self._detection: PenDetection | None = None
        self._sigmas: deque[float] = deque(maxlen=N_SMOOTHED)
        self._counts: deque[int] = deque(maxlen=N_SMOOTHED)
        self._why_none = ""
        self._has_frame = True
        self._is_swung = False

        # Widgets
        self.view = self.say(
            ImageView(),
            tip=self.tr(
                "Wheel or + and - to zoom, arrow keys to move, 0 for the whole image."
            ),
        )
        self._banner = StateBanner(TextSize.TITLE)
        self._messages = tuple(SignLabel() for _ in range(N_FINDINGS))

        # Layout
        vertical_layout(self, (self.view, 1), self._banner, *self._messages, 0)

        self._refresh()

    def set_image(self, shown: DisplayedImage) -> None:
        """Show another image."""
        detection = shown.seen.detection
        if detection is None or not detection.has_pose:
            self._forget()
        else:
            self._sigmas.append(detection.sigma)
            self._counts.append(detection.n_leds)
        self._detection = detection
        markers = self._toned(live_markers(shown.seen))
        self.view.set_half(shown.half, shown.size, tuple(markers))
        self._refresh_state()

    def clear(self) -> None:
        """Clear the image."""
        self._detection = None
        self._forget()
        self.view.clear()
        self._refresh_state()

    def set_why_unknown(self, sentence: str) -> None:
        """Show the missing inputs of the pen detection."""
        if sentence != self._why_none:
            self._why_none = sentence
            self._refresh()

    def set_has_frame(self, has_frame: bool) -> None:
        """Set whether the pen is in its frame; a match alone does not suffice."""
        if has_frame != self._has_frame:
            self._has_frame = has_frame
            self._refresh()

    def set_swung(self, is_swung: bool) -> None:
        """Set whether the pen of a swing is being detected instead."""
        if is_swung != self._is_swung:
            self._is_swung = is_swung
            self._refresh()

    def set_value(self, value: PenMatch | None) -> None:
        """Show how the pen fits the views; None while unknown."""
        self._match = value
        self._refresh()

    def doubt_of(self, match: PenMatch | None) -> str:
        """Return the most serious finding of a match, a sentence; empty without one."""
        if match is None or not match.findings:
            return ""
        return worded(match.findings[0].message)

    def reasons(self) -> dict[int, str]:
        """Return the findings on LEDs, by number."""
        findings = () if self._match is None else self._match.findings
        return {led: worded(each.message) for each in findings for led in each.leds}

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        width = self.contentsRect().width()
        self.view.setMaximumHeight(round(TALLEST * width))

    def _forget(self) -> None:
        self._sigmas.clear()
        self._counts.clear()

    def _refresh(self) -> None:
        self.view.set_message(self.tr("No image yet"))
        found = self._found()
        for i, remark in enumerate(self._messages):
            remark.set_value(found[i] if i < len(found) else StatusMessage())
            remark.setVisible(i < len(found))
        self._refresh_state()

    def _refresh_state(self) -> None:
        self._banner.set_value(self._state())

    def _toned(self, markers: Iterable[Marker]) -> Iterable[Marker]:
        """Yield the rings; mismatched LEDs have another tone."""
        marked = {str(led) for led in self.reasons()}
        for marker in markers:
            if marker.label in marked:
                tone = Tone.WARN
                yield Marker(marker.x, marker.y, marker.radius, marker.label, tone)
            else:
                yield marker

    def _state(self) -> State:
        detection = self._detection
        if detection is None or self._why_none:
            return State(self.tr("No match yet"), "", Sign.WAIT, Tone.QUIET)
        if self._is_swung:
            word = self.tr("Swing in progress")
            text = self.tr("Rings: expected from the LED file")
            return State(word, text, Sign.WAIT, Tone.QUIET)
        if detection.reason is not Reason.NONE:
            word = self.tr("Pen not found")
            text = reason_text(detection.reason)
            return State(word, text[:1].upper() + text[1:], Sign.WARNING, Tone.WARN)
        n_leds = len(detection.pixels)
        sigma = float(np.median(self._sigmas))
        n_seen = max(self._counts)  # LEDs that merge in one image do not matter
        word = self.tr("{0} of {1} LEDs").format(n_seen, n_leds)
        detail = self.tr("RMS residual {0} px").format(_pixels(sigma))
        good = n_seen == n_leds and sigma <= USUAL_SIGMA
        is_doubtful = self._match is not None and bool(self._match.findings)
        if good and self._has_frame and not is_doubtful:
            return State(word, detail, Sign.CHECK, Tone.GOOD)
        return State(word, detail, Sign.WARNING, Tone.WARN)

    def _found(self) -> list[StatusMessage]:
        match = self._match
        if self._why_none:
            return [StatusMessage.warning(self._why_none)]
        if match is None:
            return []
        if match.findings:
            remarks = [
                StatusMessage.warning(worded(each.message))
                for each in match.findings[:N_FINDINGS]
            ]
        elif not match.fits:
            words = self.tr("Tilt and turn the pen so that it is seen from all sides.")
            remarks = [StatusMessage(words, Sign.WAIT, Tone.QUIET)]
        elif not self._has_frame:
            words = self.tr(
                "The LEDs agree with the images but not with the pen frame. See the "
                "message about the file."
            )
            remarks = [StatusMessage.warning(words)]
        else:
            words = self.tr("All LEDs fit their table positions, in {0} views.")
            remarks = [StatusMessage.good(words.format(match.n_views))]
        return remarks


def _pixels(sigma: float) -> str:
    return number_text(sigma, 2 if sigma >= USUAL_SIGMA else 3)
