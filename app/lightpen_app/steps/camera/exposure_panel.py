"""Exposure and focus: assessment of the image and advice."""

import math
from collections import deque

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QLabel

from lightpen.cameras.protocol import CameraCapabilities, CameraSettings, Range
from lightpen.detection.inspection import (
    Advice,
    AutoExposure,
    Exposure,
    ExposureState,
    Inspection,
    advise,
    is_sharp,
)
from lightpen.live.pipeline import LiveImage
from lightpen_app.look.languages import listed
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import set_tooltip
from lightpen_app.steps.camera.settings_panel import SettingField
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.live_view import LiveView

MOST_NAMED = 6  # LEDs in one line


US_PER_MS = 1000.0
PADDING = 3 * GRID // 2
EXPOSURE_WIDTH, GAIN_WIDTH = 100, 88  # px, at least: of "30.00 ms" and "24.0 dB"


class ExposurePanel(Translated, QFrame):
    """The brightness of the LEDs, the settings that change it, and the advice."""

    def __init__(self, live: LiveView) -> None:
        super().__init__()
        self.setProperty("area", "panel")
        self._live = live
        self._capabilities: CameraCapabilities | None = None
        self._settings = CameraSettings()
        self._adjustment: AutoExposure | None = None

        # Widgets
        self._value = Exposure()
        self._verdict = SignLabel()
        self._levels = text_label(TextSize.LEAD)
        self._advice = text_label(TextSize.SMALL, Tone.QUIET)
        self._exposure_name = self.say(QLabel(), self.tr("E&xposure"))
        keys = self.tr(
            "Up and Down keys change the value; Enter applies a typed number."
        )
        self._exposure = self.say(
            SettingField("ms", (0.01, 1000.0), 2), self.tr("Exposure"), tip=keys
        )
        self._exposure_name.setBuddy(self._exposure)
        self._gain_name = self.say(QLabel(), self.tr("&Gain"))
        self._gain = self.say(
            SettingField("dB", (0.0, 48.0), 1), self.tr("Gain"), tip=keys
        )
        self._exposure.setMinimumWidth(EXPOSURE_WIDTH)
        self._gain.setMinimumWidth(GAIN_WIDTH)
        self._gain_name.setBuddy(self._gain)
        self._adjust = self.say(
            PushButton(),
            tip=self.tr(
                "Sets exposure and gain so that the brightest LED reaches 80 % of "
                "full scale."
            ),
        )
        self._why_fixed = text_label(TextSize.BODY, Tone.QUIET)
        self._why_fixed.setMinimumHeight(5 * GRID)  # as the fields in its place

        # Layout
        layout = vertical_layout(self, self._verdict, self._levels, margins=PADDING)
        horizontal_layout(
            layout,
            self._exposure_name,
            (self._exposure, 1),
            self._gain_name,
            (self._gain, 1),
            (self._why_fixed, 1),
        )
        horizontal_layout(layout, (self._advice, 1), self._adjust)

        # Connections
        self._exposure.value_changed.connect(self._on_exposure_edited)
        self._gain.value_changed.connect(self._on_gain_edited)
        self._adjust.clicked.connect(self._on_adjust_clicked)

        self.set_camera(None, CameraSettings())

    def set_value(self, value: Exposure) -> None:
        """Show the LEDs of another image."""
        self._value = value
        self._refresh()

    def verdict(self) -> StatusMessage:
        """Return whether all LEDs are well exposed."""
        value = self._value
        if not value.peaks:
            return StatusMessage(self.tr("No LED detected"), Sign.EYE, Tone.QUIET)
        n_leds, of_leds = len(value.peaks), value.are_leds
        if value.n_saturated:
            words = (
                self.tr("Saturated: {0} of {1} LEDs")
                if of_leds
                else self.tr("Saturated: {0} of {1} spots")
            )
            text = words.format(value.n_saturated, n_leds)
            return StatusMessage.warning(text + _named(value.saturated_leds, n_leds))
        if value.n_dark:
            words = (
                self.tr("Too dark: {0} of {1} LEDs")
                if of_leds
                else self.tr("Too dark: {0} of {1} spots")
            )
            text = words.format(value.n_dark, n_leds)
            return StatusMessage.warning(text + _named(value.dark_leds, n_leds))
        words = self.tr("OK: {0} LEDs") if of_leds else self.tr("OK: {0} spots")
        return StatusMessage.good(words.format(value.n_good))

    def set_camera(
        self, caps: CameraCapabilities | None, settings: CameraSettings
    ) -> None:
        """Show capabilities and settings of a camera; None without one."""
        self._capabilities, self._settings = caps, settings
        exposures = None if caps is None else caps.exposure_us
        gains = None if caps is None else caps.gain_db
        exposure_us, gain_db = settings.exposure_us, settings.gain_db
        if exposures is not None and exposure_us is not None:
            in_ms = Range(exposures.low / US_PER_MS, exposures.high / US_PER_MS)
            self._exposure.set_offered(in_ms, exposure_us / US_PER_MS)
        if gains is not None and gain_db is not None:
            self._gain.set_offered(gains, gain_db)
        if caps is not None:
            self._gain.set_unit("dB" if caps.gain_in_db else "")
        self._adjust.setVisible(exposures is not None)
        for widget in (self._exposure_name, self._exposure):
            widget.setVisible(exposures is not None)
        for widget in (self._gain_name, self._gain):
            widget.setVisible(gains is not None)
        self._why_fixed.setVisible(exposures is None and gains is None)
        self._refresh()

    def set_adjustment(self, adjustment: AutoExposure | None) -> None:
        """Show the state of the automatic exposure, if active."""
        self._adjustment = adjustment
        self._refresh()

    def end_adjustment(self) -> None:
        """Keep the present exposure."""
        self.set_adjustment(None)

    def adjust(self, seen: LiveImage, inspection: Inspection) -> None:
        """Continue an adjustment in progress by one more image."""
        before, caps = self._adjustment, self._live.caps
        if before is None or caps is None:
            return
        self._live.hurry()
        now = before.after(seen.frame, seen.spots, inspection, caps)
        exposure_us, gain_db = now.asked.exposure_us, now.asked.gain_db
        if exposure_us is not None and exposure_us != before.asked.exposure_us:
            self._live.set_exposure(exposure_us)
        if gain_db is not None and gain_db != before.asked.gain_db:
            self._live.set_gain(gain_db)
        self.set_adjustment(now)

    def _on_exposure_edited(self, exposure_ms: float) -> None:
        self.end_adjustment()
        self._live.set_exposure(exposure_ms * US_PER_MS)

    def _on_gain_edited(self, gain_db: float) -> None:
        self.end_adjustment()
        self._live.set_gain(gain_db)

    def _on_adjust_clicked(self) -> None:
        begins = not self._is_adjusting
        self.set_adjustment(AutoExposure.begun(self._live.settings) if begins else None)

    @property
    def _is_adjusting(self) -> bool:
        adjustment = self._adjustment
        return adjustment is not None and adjustment.outcome is ExposureState.ADJUSTING

    def _show_levels(self) -> None:
        value = self._value
        self._verdict.set_value(self.verdict())
        words = ""
        if value.peaks:
            words = self.tr("{0:.0%} to {1:.0%} of full scale").format(
                min(value.peaks), max(value.peaks)
            )
        self._levels.setText(words)
        levels = (
            self.tr("LED {0}: {1} %").format(led, f"{100 * peak:.0f}")
            for led, peak in zip(value.leds, value.peaks, strict=False)
        )
        set_tooltip(self._levels, "\n".join(levels))

    def _refresh(self) -> None:
        self._show_levels()
        self._adjust.setText(
            self.tr("Stop") if self._is_adjusting else self.tr("Auto exposure (LEDs)")
        )
        if self._capabilities is None:
            self._why_fixed.setText(self.tr("No images are received."))
            self._advice.setText("")
            return
        self._why_fixed.setText(
            self.tr("Recorded images: exposure and gain are fixed.")
        )
        adjustment = self._adjustment
        if adjustment is not None and _holds(adjustment, self._value):
            self._advice.setText(self._outcome_words(adjustment))
            return
        advice = advise(self._value, self._settings, self._capabilities)
        self._advice.setText(self._words(advice, self._capabilities))

    def _outcome_words(self, adjustment: AutoExposure) -> str:
        level = f"{100 * adjustment.level:.0f} %"
        match adjustment.outcome:
            case ExposureState.ADJUSTING:
                words = self.tr("Hold the pen still. Brightest LED: {0}")
            case ExposureState.DONE:
                words = self.tr("Exposure set. Brightest LED: {0}; none saturated.")
            case ExposureState.NO_LEDS:
                words = self.tr("No LEDs detected. Hold the pen in view of the camera.")
            case ExposureState.TOO_BRIGHT:
                words = self.tr(
                    "Image too bright at minimum exposure and gain ({0}). Close the "
                    "aperture."
                )
            case ExposureState.TOO_DARK:
                words = self.tr(
                    "LEDs reach only {0}; a longer exposure would blur the moving "
                    "pen. Open the aperture."
                )
            case ExposureState.UNSTEADY:
                words = self.tr(
                    "Brightness varies from image to image ({0}). Hold the pen "
                    "still and check the LED power supply."
                )
        return words.format(level)

    def _words(self, advice: Advice, caps: CameraCapabilities) -> str:
        is_recorded = caps.exposure_us is None and caps.gain_db is None
        match advice:
            case Advice.SHOW_PEN:
                return self.tr("Hold the pen with its LEDs facing the camera.")
            case Advice.LEAVE:
                return self.tr("All LEDs are correctly exposed.")
            case Advice.LOWER_GAIN:
                return self.tr("Lower the gain until no LED is saturated.")
            case Advice.SHORTEN_EXPOSURE:
                return self.tr("Shorten the exposure until no LED is saturated.")
            case Advice.LENGTHEN_EXPOSURE:
                return self.tr("Lengthen the exposure until all LEDs are OK.")
            case Advice.RAISE_GAIN:
                return self.tr(
                    "Raise the gain: a longer exposure would blur the moving pen."
                )
            case Advice.EVEN_OUT:
                return self.tr(
                    "LED brightness differs too much. Clean the LEDs and check "
                    "their power supply."
                )
            case Advice.CLOSE_APERTURE if is_recorded:
                return self.tr("Record the images again with a shorter exposure.")
            case Advice.OPEN_APERTURE if is_recorded:
                return self.tr("Record the images again with a longer exposure.")
            case Advice.CLOSE_APERTURE:
                return self.tr("Close the aperture slightly.")
            case Advice.OPEN_APERTURE:
                return self.tr("Open the aperture slightly.")


def _named(leds: tuple[int, ...], n_leds: int) -> str:
    """Return the numbers of the LEDs that are meant, unless all are."""
    if not leds or len(leds) == n_leds:
        return ""
    more = "\u2026" if len(leds) > MOST_NAMED else ""
    return f": {listed(map(str, leds[:MOST_NAMED]))}{more}"


def _holds(adjustment: AutoExposure, exposure: Exposure) -> bool:
    """Return whether the outcome of an adjustment is still true of the last image."""
    match adjustment.outcome:
        case ExposureState.DONE:
            return not exposure.n_saturated
        case ExposureState.NO_LEDS:
            return not exposure.peaks
    return True


N_COMPARED = 120  # images: six seconds, of which the sharpest is named


class FocusPanel(Translated, QFrame):
    """The sharpness of the LEDs, and what to do."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("area", "panel")
        self._widths: deque[float] = deque(maxlen=N_COMPARED)
        self._is_saturated = self._is_recorded = False

        # Widgets
        self._verdict = SignLabel()
        self._number = self.say(
            text_label(TextSize.LEAD),
            tip=self.tr(
                "Edge width of the LEDs from dark to bright. Hold the pen still."
            ),
        )
        self._hint = text_label(TextSize.SMALL, Tone.QUIET)
        self._hint.setAlignment(Qt.AlignmentFlag.AlignTop)

        # Layout
        shown = self._verdict, self._number, (self._hint, 1)
        vertical_layout(self, *shown, margins=PADDING)

        self._refresh()

    def add(self, inspection: Inspection) -> None:
        """Show one more image."""
        self._widths.append(inspection.edge_width)
        self._is_saturated = inspection.exposure.n_saturated > 0
        self._refresh()

    def clear(self) -> None:
        """Clear the images of the previous camera."""
        self._widths.clear()
        self._is_saturated = False
        self._refresh()

    def set_recorded(self, is_recorded: bool) -> None:
        """Show whether the images are recorded, so that settings have no effect."""
        self._is_recorded = is_recorded
        self._refresh()

    def _refresh(self) -> None:
        width = self._widths[-1] if self._widths else math.nan
        is_seen = math.isfinite(width)
        words = ""
        if not is_seen:
            verdict = StatusMessage(self.tr("No LED detected"), Sign.EYE, Tone.QUIET)
        elif self._is_saturated:
            verdict = StatusMessage.warning(self.tr("Saturated"))
        elif is_sharp(width):
            verdict = StatusMessage.good(self.tr("In focus"))
        else:
            verdict = StatusMessage.warning(self.tr("Out of focus"))
        if is_seen:
            best = min(filter(math.isfinite, self._widths))
            words = self.tr("{0:.1f} px, best {1:.1f} px").format(width, best)
        self._verdict.set_value(verdict)
        self._number.setText(words)
        if self._is_recorded:
            hint = self.tr("Recorded images: focus is fixed.")
        elif self._is_saturated:
            hint = self.tr(
                "Reduce the exposure first: saturated LEDs give no edge width."
            )
        else:
            hint = self.tr("Turn the focus ring until the edge width is smallest.")
        self._hint.setText(hint)
