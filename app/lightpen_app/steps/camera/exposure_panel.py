"""Exposure and focus: what the image says of them, and what to do."""

from collections import deque

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from lightpen.cameras.protocol import CameraSettings, Caps, Range
from lightpen.detection.auto_exposure import AutoExposure, Standing
from lightpen.detection.exposure_advice import Advice, advise
from lightpen.detection.inspection import Exposure, Inspection
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.steps.camera.exposure_bar import ExposureBar
from lightpen_app.steps.camera.focus_meter import N_TRACED, FocusMeter
from lightpen_app.steps.camera.setting_field import SettingField
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated

US_PER_MS = 1000.0
PADDING = 3 * GRID // 2
EXPOSURE_WIDTH, GAIN_WIDTH = 100, 88  # px, at least: of "30.00 ms" and "24.0 dB"


class ExposurePanel(Translated, QFrame):
    """The brightness of the LEDs, the settings that change it, and the advice.

    Signals
    -------
    exposure_changed(float)
        Asked for, us.
    gain_changed(float)
        Asked for, dB.
    adjustment_requested(bool)
        The program is to set both by the LEDs, or to stop doing so.
    """

    exposure_changed = Signal(float)
    gain_changed = Signal(float)
    adjustment_requested = Signal(bool)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("area", "panel")
        self._caps: Caps | None = None
        self._settings = CameraSettings()
        self._adjustment: AutoExposure | None = None

        # Widgets
        self._bar = ExposureBar()
        self._advice = text_label(TextSize.SMALL, Tone.QUIET)
        self._exposure_name = QLabel()
        self._exposure = SettingField("ms", (0.01, 1000.0), 2)
        self._exposure_name.setBuddy(self._exposure)
        self._gain_name = QLabel()
        self._gain = SettingField("dB", (0.0, 48.0), 1)
        self._exposure.setMinimumWidth(EXPOSURE_WIDTH)
        self._gain.setMinimumWidth(GAIN_WIDTH)
        self._gain_name.setBuddy(self._gain)
        self._adjust = PushButton()
        self._why_fixed = text_label(TextSize.BODY, Tone.QUIET)
        self._why_fixed.setMinimumHeight(5 * GRID)  # that of the fields it stands for

        # Layout
        fields = QHBoxLayout()
        fields.setSpacing(GRID)
        fields.addWidget(self._exposure_name)
        fields.addWidget(self._exposure, 1)
        fields.addWidget(self._gain_name)
        fields.addWidget(self._gain, 1)
        fields.addWidget(self._why_fixed, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(PADDING, PADDING, PADDING, PADDING)
        layout.setSpacing(GRID)
        layout.addWidget(self._bar)
        layout.addLayout(fields)
        foot = QHBoxLayout()
        foot.setSpacing(GRID)
        foot.addWidget(self._advice, 1)
        foot.addWidget(self._adjust)
        layout.addLayout(foot)

        # Connections
        self._exposure.valueChanged.connect(self._on_exposure_edited)
        self._gain.valueChanged.connect(self.gain_changed)
        self._adjust.clicked.connect(self._on_adjust_clicked)

        self._retranslate()
        self.set_camera(None, CameraSettings())

    def set_value(self, value: Exposure) -> None:
        """Show the LEDs of another image."""
        self._bar.set_value(value)
        self._refresh()

    def set_camera(self, caps: Caps | None, settings: CameraSettings) -> None:
        """Show what a camera offers and has in force; None where none is open."""
        self._caps, self._settings = caps, settings
        exposures = None if caps is None else caps.exposure_us
        gains = None if caps is None else caps.gain_db
        exposure_us, gain_db = settings.exposure_us, settings.gain_db
        if exposures is not None and exposure_us is not None:
            in_ms = Range(exposures.low / US_PER_MS, exposures.high / US_PER_MS)
            self._exposure.set_offered(in_ms, exposure_us / US_PER_MS)
        if gains is not None and gain_db is not None:
            self._gain.set_offered(gains, gain_db)
        if caps is not None:
            self._gain.setSuffix(" dB" if caps.gain_in_db else "")
        self._adjust.setVisible(exposures is not None)
        for widget in (self._exposure_name, self._exposure):
            widget.setVisible(exposures is not None)
        for widget in (self._gain_name, self._gain):
            widget.setVisible(gains is not None)
        self._why_fixed.setVisible(exposures is None and gains is None)
        self._refresh()

    def set_adjustment(self, adjustment: AutoExposure | None) -> None:
        """Show how the adjustment by the LEDs stands, if there is one."""
        self._adjustment = adjustment
        self._refresh()

    def advice(self) -> str:
        """Return what to do, a sentence."""
        return self._advice.text()

    def _on_exposure_edited(self, exposure_ms: float) -> None:
        self.exposure_changed.emit(exposure_ms * US_PER_MS)

    def _on_adjust_clicked(self) -> None:
        self.adjustment_requested.emit(not self._is_adjusting)

    @property
    def _is_adjusting(self) -> bool:
        adjustment = self._adjustment
        return adjustment is not None and adjustment.outcome is Standing.ADJUSTING

    def _retranslate(self) -> None:
        self._exposure_name.setText(self.tr("E&xposure"))
        self._exposure.setAccessibleName(self.tr("Exposure"))
        self._gain_name.setText(self.tr("&Gain"))
        self._gain.setAccessibleName(self.tr("Gain"))
        for field in (self._exposure, self._gain):
            field.setToolTip(
                self.tr("Up and Down change it; Enter takes a typed number.")
            )
        self._refresh()

    def _refresh(self) -> None:
        self._adjust.setText(
            self.tr("Stop") if self._is_adjusting else self.tr("Set by the LEDs")
        )
        self._adjust.setToolTip(
            self.tr("Exposure and gain for 80 % of full scale at the brightest LED.")
        )
        if self._caps is None:
            self._why_fixed.setText(self.tr("No images come."))
            self._advice.setText("")
            return
        self._why_fixed.setText(
            self.tr("Recorded: exposure and gain are as they were taken.")
        )
        adjustment = self._adjustment
        if adjustment is not None and _holds(adjustment, self._bar.value()):
            self._advice.setText(self._outcome_words(adjustment))
            return
        advice = advise(self._bar.value(), self._settings, self._caps)
        self._advice.setText(self._words(advice, self._caps))

    def _outcome_words(self, adjustment: AutoExposure) -> str:
        level = f"{100 * adjustment.level:.0f} %"
        match adjustment.outcome:
            case Standing.ADJUSTING:
                words = self.tr("Hold the pen still. Brightest LED: {0}")
            case Standing.DONE:
                words = self.tr("Set. Brightest LED: {0}, none is saturated.")
            case Standing.NO_LEDS:
                words = self.tr("No LEDs are seen. Hold the pen before the camera.")
            case Standing.TOO_BRIGHT:
                words = self.tr(
                    "The least exposure and gain are too bright ({0}). Close the "
                    "aperture of the lens."
                )
            case Standing.TOO_DARK:
                words = self.tr(
                    "The LEDs reach {0} only: a longer exposure would smear the moving "
                    "pen. Open the aperture of the lens."
                )
            case Standing.UNSTEADY:
                words = self.tr(
                    "The light changes from image to image ({0}). Hold the pen still, "
                    "and check the supply of its LEDs."
                )
        return words.format(level)

    def _words(self, advice: Advice, caps: Caps) -> str:
        is_recorded = caps.exposure_us is None and caps.gain_db is None
        match advice:
            case Advice.SHOW_PEN:
                return self.tr("Hold the pen so that the camera sees its LEDs.")
            case Advice.LEAVE:
                return self.tr("All lie in the good part of the scale.")
            case Advice.LOWER_GAIN:
                return self.tr("Lower the gain until no LED is saturated.")
            case Advice.SHORTEN_EXPOSURE:
                return self.tr("Shorten the exposure until no LED is saturated.")
            case Advice.LENGTHEN_EXPOSURE:
                return self.tr("Lengthen the exposure until all LEDs are good.")
            case Advice.RAISE_GAIN:
                return self.tr(
                    "Raise the gain: a longer exposure would smear the moving pen."
                )
            case Advice.EVEN_OUT:
                return self.tr(
                    "The LEDs differ too much in brightness. Clean them, and check "
                    "their supply."
                )
            case Advice.CLOSE_APERTURE if is_recorded:
                return self.tr("Take the images again with a shorter exposure.")
            case Advice.OPEN_APERTURE if is_recorded:
                return self.tr("Take the images again with a longer exposure.")
            case Advice.CLOSE_APERTURE:
                return self.tr("Close the aperture of the lens a little.")
            case Advice.OPEN_APERTURE:
                return self.tr("Open the aperture of the lens a little.")


def _holds(adjustment: AutoExposure, exposure: Exposure) -> bool:
    """Return whether the outcome of an adjustment is still true of the last image."""
    match adjustment.outcome:
        case Standing.DONE:
            return not exposure.n_saturated
        case Standing.NO_LEDS:
            return not exposure.peaks
    return True


class FocusPanel(Translated, QFrame):
    """The sharpness of the LEDs, and what to do."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("area", "panel")
        self._widths: deque[float] = deque(maxlen=N_TRACED)
        self._is_saturated = self._is_recorded = False

        # Widgets
        self._meter = FocusMeter()
        self._hint = text_label(TextSize.SMALL, Tone.QUIET)
        self._hint.setAlignment(Qt.AlignmentFlag.AlignTop)

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(PADDING, PADDING, PADDING, PADDING)
        layout.setSpacing(GRID)
        layout.addWidget(self._meter)
        layout.addWidget(self._hint, 1)

        self._retranslate()

    def add(self, inspection: Inspection) -> None:
        """Show one more image."""
        self._widths.append(inspection.edge_width)
        self._is_saturated = inspection.exposure.n_saturated > 0
        self._meter.set_value(self._widths, is_saturated=self._is_saturated)
        self._refresh()

    def clear(self) -> None:
        """Forget the images, as those of another camera."""
        self._widths.clear()
        self._is_saturated = False
        self._meter.set_value(())
        self._refresh()

    def set_recorded(self, is_recorded: bool) -> None:
        """Say whether the images are as they were taken, whatever is turned now."""
        self._is_recorded = is_recorded
        self._refresh()

    def hint(self) -> str:
        """Return what to do, a sentence."""
        return self._hint.text()

    def _refresh(self) -> None:
        if self._is_recorded:
            words = self.tr("Recorded: the focus is as it was.")
        elif self._is_saturated:
            words = self.tr("Lower the exposure first: now this tells nothing.")
        else:
            words = self.tr("Turn the focus ring until the rims are narrowest.")
        self._hint.setText(words)

    def _retranslate(self) -> None:
        self._refresh()
        self._meter.setToolTip(
            self.tr("Width of the LEDs' rims from dark to bright. Hold the pen still.")
        )
