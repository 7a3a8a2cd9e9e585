"""Selection of the image source."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from PySide6.QtCore import QObject, QSignalBlocker, Signal
from PySide6.QtWidgets import QFileDialog, QGroupBox, QMenu, QSizePolicy, QWidget

from lightpen.cameras.source import FoundDevice, Source, SourceNeeds
from lightpen.cameras.sources import absent_sources
from lightpen.formats.images import SUFFIXES, VIDEO_SUFFIXES
from lightpen.messages import Message
from lightpen.record.swings.solving import FilesBeside, files_beside
from lightpen.swing.preparation import NO_SOURCE, SourceChoice, SourceKind
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, Tone, set_tone
from lightpen_app.look.words import set_tooltip, shortened
from lightpen_app.widgets.controls import FileDrops, PushButton
from lightpen_app.widgets.fields import ChoiceField, EnterEdit, PathField, Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.camera_setup import CameraSetup
from lightpen_app.work.chosen_files import ChosenFiles
from lightpen_app.work.job import Job, LatestJob
from lightpen_app.work.selection import Selection


class DeviceField(ChoiceField):
    """A camera, taken over when it is chosen, or typed and Enter pressed."""

    # Another camera was given, or the same one again by Enter.
    value_changed = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self._value = ""
        self.setEditable(True)
        self.setInsertPolicy(ChoiceField.InsertPolicy.NoInsert)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.edit = edit = EnterEdit()
        self.setLineEdit(edit)
        self.setCompleter(None)  # type: ignore[arg-type] # Qt takes it away by this

        # Connections
        self.activated.connect(lambda at: self._take(str(self.itemData(at))))
        edit.returnPressed.connect(self._on_return_pressed)

    def set_value(self, value: str) -> None:
        """Show another camera."""
        self._value = value
        index = self.findData(value)
        with QSignalBlocker(self):
            self.setCurrentIndex(index)
            self.setEditText(value if index < 0 else self.itemText(index))

    def set_found(self, found: tuple[FoundDevice, ...]) -> None:
        """Offer other cameras."""
        with QSignalBlocker(self):
            self.clear()
            for device in found:
                self.addItem(device.label, device.place)
        self.set_value(self._value)

    def set_faulty(self, faulty: bool) -> None:
        """Mark the camera as one that cannot be opened."""
        set_tone(self.edit, Tone.BAD if faulty else Tone.PLAIN)

    def _on_return_pressed(self) -> None:
        text = self.currentText().strip()
        index = self.findText(text)
        self._take(text if index < 0 else str(self.itemData(index)))

    def _take(self, value: str) -> None:
        self.set_value(value)
        self.value_changed.emit(value)


LONGEST_LABEL = 32  # letters of a camera on a button


class SourcePanel(Translated, QGroupBox):
    """The choice of a source.

    The files of a second camera are the rig's.
    """

    value_changed = Signal(object)  # SourceChoice
    search_requested = Signal()  # search for cameras of the selected source
    samples_requested = Signal()  # use the files of the simulated pen
    retry_requested = Signal()  # open the same source once more
    # FilesBeside: files beside the recorded images to use
    files_requested = Signal(object)

    def __init__(self, sources: Sequence[Source], *, is_second: bool = False) -> None:
        super().__init__()
        self._sources = tuple(sources)
        self._is_second = is_second
        self._value = NO_SOURCE
        self._absent: Mapping[str, Message] = {}
        self._is_searching = False
        self._outcome: Callable[[], StatusMessage] = StatusMessage

        # Widgets
        title = self.tr("Image source")
        if is_second:
            title = self.tr("Image source of the second camera")
        self.say(self, title)
        choose = self.tr("Choose your camera")
        self._kind = self.say(ChoiceField(), title, hint=choose)
        # No wider than its neighbours, however long its words.
        self._kind.setSizeAdjustPolicy(
            ChoiceField.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        self._kind.setMinimumWidth(22 * GRID)  # the placeholder would widen it
        for _ in self._sources:
            self._kind.addItem("")
        self._place = self.say(PathField(), hint=self.tr("Folder, record or video"))
        self._pick = self.make_button(self.tr("Open..."))
        self._pick.setProperty("menu", True)
        self._place.add_button(self._pick)
        menu = QMenu(self._pick)
        self._folder = self.say(menu.addAction(""), self.tr("Folder or record..."))
        self._file = self.say(menu.addAction(""), self.tr("Video..."))
        self._pick.setMenu(menu)
        self._producer = self.say(
            PathField(),
            hint=self.tr("GenTL producers of the system"),
            name=self.tr("GenTL producer"),
        )
        self._open_producer = self.make_button(
            self.tr("Open..."), self._on_open_producer_clicked
        )
        self._producer.add_button(self._open_producer)
        self._device = DeviceField()
        place = self.tr("Serial number or address")
        self.say(self._device, place)
        self.say(self._device.edit, hint=place)
        self._search = self.make_button(self.tr("Search"), self.search_requested)
        self._remark_label = SignLabel()
        self._offers = QWidget()  # the cameras found, before a source is chosen
        self._samples = self.make_button(
            self.tr("Use its files"),
            self.samples_requested,
            tip=self.tr(
                "Use the intrinsics file and the LED file of the simulated pen."
            ),
        )
        self._retry = self.make_button(self.tr("Try again"), self.retry_requested)
        self._beside = FilesBeside()
        self._found = SignLabel()
        self._use_found = PushButton()

        # Layout
        layout = vertical_layout(self)
        fill(layout, self._offers)
        self._offers_layout = vertical_layout(self._offers)
        horizontal_layout(layout, (self._kind, 1), self._samples)
        fill(layout, self._place, self._producer)
        horizontal_layout(layout, (self._device, 1), self._search)
        fill(layout, self._remark_label, self._found, self._use_found, self._retry)

        # Connections
        self._kind.activated.connect(self._on_kind_chosen)
        self._place.value_changed.connect(self._on_place_changed)
        self._device.value_changed.connect(self._on_place_changed)
        self._producer.value_changed.connect(self._on_producer_changed)
        self._folder.triggered.connect(self._on_folder_triggered)
        self._file.triggered.connect(self._on_file_triggered)
        self._use_found.clicked.connect(lambda: self.files_requested.emit(self._beside))
        FileDrops(self).dropped.connect(self._on_dropped)

        self.set_faulty(False)
        self._refresh()

    def value(self) -> SourceChoice:
        """Return the source."""
        return self._value

    def set_value(self, value: SourceChoice) -> None:
        """Show another source."""
        if value == self._value:
            return
        if value.kind != self._value.kind:
            self._device.set_found(())
            self._outcome = StatusMessage
            self._is_searching = False
        self._value = value
        if self._needs is SourceNeeds.FILES:
            self._place.set_value(value.place)
        elif self._has_device:
            self._device.set_value(value.place)
            self._producer.set_value(value.producer)
        self._refresh()

    def set_absent(self, absent: Mapping[str, Message]) -> None:
        """Show what must be installed for sources, by their keys."""
        self._absent = absent
        self._refresh()

    @property
    def is_searching(self) -> bool:
        """Whether cameras of the selected source are being searched."""
        return self._is_searching

    def set_searching(self, is_searching: bool) -> None:
        """Show whether a search for cameras is in progress."""
        self._is_searching = is_searching
        if is_searching:
            self._producer.set_faulty(False)
        self._refresh()

    def set_found(self, found: tuple[FoundDevice, ...]) -> None:
        """Offer the cameras that were found; the first if none is chosen yet."""
        self._device.set_found(found)
        self._outcome = partial(self._found_message, len(found))
        self._refresh()
        if found and not self._value.place:
            self._choose(replace(self._value, place=found[0].place))

    def set_offers(self, found: tuple[tuple[Source, FoundDevice], ...]) -> None:
        """Offer the cameras of all sources, each by a button."""
        self._is_searching = False
        self._outcome = partial(self._found_message, len(found))
        for button in self._offers.findChildren(PushButton):
            button.deleteLater()
        for each in found:
            self._offers_layout.addWidget(self._offer(*each))
        self._refresh()

    def set_search_problem(self, why: str) -> None:
        """Show why cameras cannot be searched."""
        self._outcome = partial(StatusMessage.fault, why)
        self._producer.set_faulty(bool(self._value.producer))
        self._refresh()

    def set_beside(self, files: FilesBeside) -> None:
        """Offer files beside the recorded images."""
        self._beside = files
        self._refresh_beside()

    def set_faulty(self, faulty: bool) -> None:
        """Mark the source as one that could not be opened, and offer to try again."""
        self._place.set_faulty(faulty)
        self._device.set_faulty(faulty)
        self._retry.setVisible(faulty)

    @property
    def _needs(self) -> SourceNeeds:
        return self._value.source.needs

    @property
    def _has_device(self) -> bool:
        return self._needs in (SourceNeeds.DEVICE, SourceNeeds.DEVICE_AND_PRODUCER)

    def _offer(self, source: Source, device: FoundDevice) -> PushButton:
        button, choice = PushButton(), SourceChoice(source.key, device.place)
        button.setText(shortened(device.label, LONGEST_LABEL))
        set_tooltip(button, f"{device.label}, {worded(source.name)}")
        button.clicked.connect(lambda: self._choose(choice))
        return button

    def _on_kind_chosen(self, index: int) -> None:
        source = self._sources[index]
        place = self._place.value() if source.needs is SourceNeeds.FILES else ""
        self._choose(SourceChoice(source.key, place))
        if source.needs is SourceNeeds.FILES and not place:
            self._place.setFocus()
        elif self._has_device and source.key not in self._absent:
            self.search_requested.emit()

    def _on_place_changed(self, place: str) -> None:
        chosen = replace(self._value, place=place)
        if chosen == self._value:
            self.retry_requested.emit()
        else:
            self._choose(chosen)

    def _on_producer_changed(self, producer: str) -> None:
        self._choose(replace(self._value, producer=producer, place=""))
        self.search_requested.emit()

    def _on_open_producer_clicked(self) -> None:
        self._producer.pick(
            QFileDialog.FileMode.ExistingFile,
            self.tr("GenTL producer of the camera"),
            self.tr("GenTL producers ({0})").format("*.cti"),
        )

    def _on_dropped(self, path: str) -> None:
        """Take images that are dropped here, whatever the source was."""
        self._place.set_value(path)
        self._choose(SourceChoice(SourceKind.RECORDED, path))

    def _on_folder_triggered(self) -> None:
        self._place.pick(
            QFileDialog.FileMode.Directory, self.tr("Folder of the recorded images")
        )

    def _on_file_triggered(self) -> None:
        patterns = " ".join(f"*{suffix}" for suffix in (*VIDEO_SUFFIXES, *SUFFIXES))
        self._place.pick(
            QFileDialog.FileMode.ExistingFile,
            self.tr("Video of the pen"),
            self.tr("Videos and images ({0})").format(patterns),
        )

    def _choose(self, value: SourceChoice) -> None:
        if value != self._value:
            self.set_value(value)
            self.value_changed.emit(value)

    def _refresh(self) -> None:
        self._refresh_kinds()
        needs, absent = self._needs, self._absent.get(self._value.source.key)
        is_open = self._value.source not in self._sources
        index = -1 if is_open else self._sources.index(self._value.source)
        self._kind.setCurrentIndex(index)
        self._offers.setVisible(is_open)
        self._place.setVisible(needs is SourceNeeds.FILES)
        is_usable = self._has_device and absent is None
        self._producer.setVisible(
            is_usable and needs is SourceNeeds.DEVICE_AND_PRODUCER
        )
        self._device.setVisible(is_usable)
        self._search.setVisible(is_usable)
        self._search.set_why_not(
            self.tr("Search in progress") if self._is_searching else ""
        )
        is_simulated = self._value.kind == SourceKind.SIMULATED
        self._samples.setVisible(is_simulated and not self._is_second)
        self._remark_label.set_value(self._remark(absent))
        self._refresh_beside()

    def _remark(self, absent: Message | None) -> StatusMessage:
        if not (self._has_device or self._needs is SourceNeeds.CHOICE):
            return StatusMessage()
        if absent is not None:
            return StatusMessage.warning(worded(absent))
        if self._is_searching:
            words = self.tr("Searching for cameras")
            return StatusMessage(words, Sign.WAIT, Tone.ACTIVE)
        return self._outcome()

    def _found_message(self, n_found: int) -> StatusMessage:
        if n_found:
            return StatusMessage.good(self.tr("Cameras found: {0}").format(n_found))
        words = self.tr(
            "No camera found. Check power and cable, or enter its serial number or "
            "address."
        )
        return StatusMessage.warning(words)

    def _refresh_beside(self) -> None:
        files = [f for f in (self._beside.camera, self._beside.pen) if f is not None]
        is_offered = bool(files) and self._needs is SourceNeeds.FILES
        names = self.tr(" and ").join(file.name for file in files)
        text = self.tr("Found with the images: {0}").format(names) if is_offered else ""
        self._found.set_value(StatusMessage(text, Sign.RING, Tone.ACTIVE))
        use = self.tr("Use both files") if len(files) > 1 else self.tr("Use file")
        self._use_found.setText(use)
        self._use_found.setVisible(is_offered)

    def _refresh_kinds(self) -> None:
        for index, source in enumerate(self._sources):
            name = worded(source.name)
            if source.key in self._absent:
                name = self.tr("{0} - not installed").format(name)
            self._kind.setItemText(index, name)
        # On Linux the accessible name of a drop-down list is its current choice.
        self._kind.setAccessibleDescription(self.title())


class SourceSearch(QObject):
    """Searches cameras for the panel that asked last, and installed libraries."""

    def __init__(self, camera: CameraSetup, *panels: SourcePanel) -> None:
        super().__init__(panels[0])
        self._camera = camera
        self._asking = panels[0]
        job = Job(lambda _: absent_sources(), self)

        # Connections
        for panel in panels:
            panel.search_requested.connect(partial(self._start, panel))
            job.succeeded.connect(panel.set_absent)
        camera.cameras_found.connect(self._on_found)
        camera.search_failed.connect(self._on_failed)
        camera.all_found.connect(panels[0].set_offers)

        job.start()

    def _start(self, panel: SourcePanel) -> None:
        self._asking.set_searching(False)
        self._asking, source = panel, panel.value()
        self._camera.search(source.kind, source.producer)
        panel.set_searching(True)

    def _on_found(self, found: tuple[FoundDevice, ...]) -> None:
        if self._asking.is_searching:  # else another source is chosen by now
            self._asking.set_searching(False)
            self._asking.set_found(found)

    def _on_failed(self, why: str) -> None:
        if self._asking.is_searching:
            self._asking.set_searching(False)
            self._asking.set_search_problem(why)


class BesideControl(QObject):
    """Offers files beside recorded images unless they are in use."""

    def __init__(
        self, selection: Selection, files: ChosenFiles, panel: SourcePanel
    ) -> None:
        super().__init__(panel)
        self._selection = selection
        self._panel = panel
        self._looking = LatestJob(self)
        self._source = SourceChoice()
        self._found = FilesBeside()

        # Connections
        panel.files_requested.connect(files.use_files)

    def follow(self, source: SourceChoice) -> None:
        """Offer the files of a source."""
        if source != self._source:
            self._look(source)
        self._offer()

    def shut_down(self) -> None:
        """Stop."""
        self._looking.cancel()

    def _look(self, source: SourceChoice) -> None:
        self._source, self._found = source, FilesBeside()
        self.shut_down()
        if source.kind != SourceKind.RECORDED or not source.place:
            return
        self._looking.start(lambda _: files_beside(source.place), self._on_found)

    def _on_found(self, files: FilesBeside) -> None:
        self._found = files
        self._offer()

    def _offer(self) -> None:
        now, beside = self._selection.preparation, self._found
        camera = None if now.camera_file is None else now.camera_file.path
        pen = None if now.pen_file is None else now.pen_file.path
        others = FilesBeside(
            None if beside.camera == camera else beside.camera,
            None if beside.pen == pen else beside.pen,
        )
        self._panel.set_beside(others)
