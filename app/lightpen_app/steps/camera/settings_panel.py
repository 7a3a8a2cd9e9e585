"""Further camera settings: rate, region, pixel format, trigger, packets."""

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtWidgets import QGroupBox, QLabel, QWidget

from lightpen.cameras.pixel_formats import pixel_format_named
from lightpen.cameras.protocol import (
    CameraCapabilities,
    CameraSettings,
    Range,
    Region,
    Stats,
    TriggerMode,
)
from lightpen_app.look.layouts import fill, grid_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import PARTED, on_one_line
from lightpen_app.widgets.fields import ChoiceField, Translated
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage

FIELD_WIDTH = 13 * GRID  # px, at least: of "30.00 ms"


class SettingField(NumberField):
    """A number that takes effect when it is stepped, or typed and Enter pressed."""

    def __init__(self, unit: str, limits: tuple[float, float], n_decimals: int) -> None:
        super().__init__(unit, limits, n_decimals)
        self.setMinimumWidth(FIELD_WIDTH)

    def set_offered(self, offered: Range, value: float) -> None:
        """Show range and value of the camera in the unit of the field."""
        with QSignalBlocker(self):
            self.set_limits(offered.low, offered.high)
            self.set_value(value)


LARGEST = 100_000  # px or bytes, of a field before the range of the camera is known


class SettingsPanel(Translated, QGroupBox):
    """The settings of a camera, with the ranges that it offers."""

    # CameraSettings: the requested ones; others are None
    settings_changed = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Camera settings"))
        self._capabilities: CameraCapabilities | None = None
        self._settings = CameraSettings()
        self._stats = Stats()

        # Widgets
        self._rate = SettingField("", (0.1, 1000.0), 1)
        self._rate_name = self.make_label(self._rate, self.tr("Frame rate"))
        self._format, self._trigger = ChoiceField(), ChoiceField()
        self._format_name = self.make_label(self._format, self.tr("Pixel format"))
        self._trigger_name = self.make_label(self._trigger, self.tr("Trigger"))
        self._packet = SettingField("B", (0, LARGEST), 0)
        self._packet_name = self.make_label(
            self._packet,
            self.tr("Packet size"),
            tip=self.tr(
                "Larger packets reduce the computer load. Network card and switches "
                "must support them (jumbo frames)."
            ),
        )
        self._width = SettingField("px", (1, LARGEST), 0)
        self._size_name = self.make_label(self._width, self.tr("Region width"))
        self.say(self._size_name, self.tr("Region"))
        self._height = self.say(
            SettingField("px", (1, LARGEST), 0), self.tr("Region height")
        )
        self._x = SettingField("px", (0, LARGEST), 0)
        self._place_name = self.make_label(self._x, self.tr("Region from left"))
        self.say(self._place_name, self.tr("from left, top"))
        self._y = self.say(
            SettingField("px", (0, LARGEST), 0), self.tr("Region from top")
        )
        self._whole = self.make_button(self.tr("Whole sensor"), self._on_whole_clicked)
        self._hint = SignLabel()
        self._counts = self.say(
            text_label(TextSize.SMALL, Tone.QUIET),
            tip=self.tr(
                "Images of this camera: received; incomplete and discarded; lost; "
                "not processed because the computer was too slow."
            ),
        )

        # Layout
        rows: tuple[tuple[QWidget, ...], ...] = (
            (self._rate_name, self._rate),
            (self._format_name, self._format),
            (self._trigger_name, self._trigger),
            (self._packet_name, self._packet),
            (self._size_name, self._width, self._height),
            (self._place_name, self._x, self._y),
        )
        layout = vertical_layout(self)
        grid = grid_layout(layout)
        for row, (name, *fields) in enumerate(rows):
            grid.addWidget(name, row, 0)
            span = 2 // len(fields)
            for column, field in enumerate(fields):
                grid.addWidget(field, row, 1 + column, 1, span)
        grid.addWidget(self._whole, len(rows), 1, 1, 2)
        grid.setColumnStretch(1, 1)
        grid.setColumnStretch(2, 1)
        fill(layout, self._hint, self._counts)

        # Connections
        ask, chosen = self.settings_changed.emit, CameraSettings
        self._rate.value_changed.connect(lambda rate: ask(chosen(frame_rate=rate)))
        self._packet.value_changed.connect(
            lambda size: ask(chosen(packet_size=round(size)))
        )
        self._format.activated.connect(self._on_format_chosen)
        self._trigger.activated.connect(self._on_trigger_chosen)
        for field in (self._width, self._height, self._x, self._y):
            field.value_changed.connect(self._on_region_edited)

        self._refresh()
        self.set_camera(None, CameraSettings())

    def set_stats(self, stats: Stats) -> None:
        """Show the frame counters of this camera."""
        self._stats = stats
        self._refresh_counts()

    def set_camera(
        self, caps: CameraCapabilities | None, settings: CameraSettings
    ) -> None:
        """Show capabilities and settings; hidden without any."""
        self._capabilities, self._settings = caps, settings
        is_live = caps is not None and caps.n_images is None
        self.setVisible(is_live)
        if caps is None or not is_live:
            return
        self._offer((self._rate_name, self._rate), caps.frame_rate, settings.frame_rate)
        self._offer(
            (self._packet_name, self._packet), caps.packet_size, settings.packet_size
        )
        self._offer_choices(
            self._format, caps.pixel_formats, settings.pixel_format or ""
        )
        triggers = tuple(map(str, caps.triggers))
        self._offer_choices(self._trigger, triggers, settings.trigger or triggers[0])
        for widget in (self._trigger_name, self._trigger):
            widget.setVisible(len(triggers) > 1)
        self._offer_region(caps, settings.region)
        self._refresh_triggers()
        self._hint.set_value(self._format_hint())

    def _offer(
        self,
        widgets: tuple[QLabel, SettingField],
        offered: Range | None,
        value: float | None,
    ) -> None:
        name, field = widgets
        is_there = offered is not None and value is not None
        name.setVisible(is_there)
        field.setVisible(is_there)
        if offered is not None and value is not None:
            field.set_offered(offered, value)

    def _offer_choices(
        self, field: ChoiceField, offered: tuple[str, ...], chosen: str
    ) -> None:
        before = tuple(field.itemData(index) for index in range(field.count()))
        with QSignalBlocker(field):
            if offered != before:  # else the user may be choosing
                field.clear()
                for each in offered:
                    field.addItem(each, each)
            field.setCurrentIndex(field.findData(chosen))

    def _offer_region(self, caps: CameraCapabilities, region: Region | None) -> None:
        limits = caps.regions
        is_there = limits is not None and region is not None
        can_move = limits is not None and min(limits.x_step, limits.y_step) > 0
        for widget in (self._size_name, self._width, self._height, self._whole):
            widget.setVisible(is_there)
        for widget in (self._place_name, self._x, self._y):
            widget.setVisible(is_there and can_move)
        if limits is None or region is None:
            return
        self._width.set_offered(limits.width, region.width)
        self._height.set_offered(limits.height, region.height)
        self._x.set_offered(Range(0, limits.width.high - region.width), region.x)
        self._y.set_offered(Range(0, limits.height.high - region.height), region.y)
        is_whole = region == limits.whole
        self._whole.set_why_not(
            self.tr("The whole sensor is already in use.") if is_whole else ""
        )

    def _on_format_chosen(self, index: int) -> None:
        name = str(self._format.itemData(index))
        self.settings_changed.emit(CameraSettings(pixel_format=name))

    def _on_trigger_chosen(self, index: int) -> None:
        mode = TriggerMode(self._trigger.itemData(index))
        self.settings_changed.emit(CameraSettings(trigger=mode))

    def _on_region_edited(self) -> None:
        fields = (self._x, self._y, self._width, self._height)
        region = Region(*(round(field.value()) for field in fields))
        self.settings_changed.emit(CameraSettings(region=region))

    def _on_whole_clicked(self) -> None:
        if self._capabilities is not None and self._capabilities.regions is not None:
            whole = CameraSettings(region=self._capabilities.regions.whole)
            self.settings_changed.emit(whole)

    def _format_hint(self) -> StatusMessage:
        pixel_format = pixel_format_named(self._settings.pixel_format or "")
        if pixel_format is None or pixel_format.is_mono:
            return StatusMessage()
        words = self.tr(
            "Colour images are converted to grey, which reduces accuracy. Use a "
            "grey format such as Mono8, or better a monochrome camera."
        )
        return StatusMessage.warning(words)

    def _refresh_counts(self) -> None:
        stats = self._stats
        counts = (
            self.tr("Received: {0}").format(stats.delivered),
            self.tr("Incomplete: {0}").format(stats.incomplete),
            self.tr("Lost: {0}").format(stats.missed),
            self.tr("Not processed: {0}").format(stats.skipped),
        )
        self._counts.setText(PARTED.join(map(on_one_line, counts)))

    def _refresh_triggers(self) -> None:
        words = {
            TriggerMode.FREE: self.tr("Free running"),
            TriggerMode.SOFTWARE: self.tr("Software trigger"),
        }
        for index in range(self._trigger.count()):
            mode = TriggerMode(self._trigger.itemData(index))
            self._trigger.setItemText(index, words[mode])

    def _refresh(self) -> None:
        self._rate.set_unit(self.tr("fps"))
        self._refresh_counts()
        self._refresh_triggers()
        self._hint.set_value(self._format_hint())
