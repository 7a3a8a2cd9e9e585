"""The first view of a new user, and the set-up of a station."""

from dataclasses import asdict, replace
from pathlib import Path
from string import Template

from PySide6.QtCore import QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QFileDialog, QGroupBox, QSizePolicy, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.record.library.tip_library import ItemKind
from lightpen.swing.preparation import NO_SOURCE, Preparation, SourceChoice, SourceKind
from lightpen_app.look.layouts import (
    fill,
    horizontal_layout,
    set_stacked,
    vertical_layout,
)
from lightpen_app.look.phrases import missing_input_text
from lightpen_app.look.signs import draw_svg
from lightpen_app.look.theme import GRID, TextSize, Tone, colors_of, text_label
from lightpen_app.look.words import breakable, shortened
from lightpen_app.steps.start.form import LimitsForm, NamesForm
from lightpen_app.steps.start.limits_dialog import AssumptionsDialog
from lightpen_app.widgets.controls import PushButton, open_folder
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.job import Notifications
from lightpen_app.work.selection import TRIAL, is_trial_ready
from lightpen_app.work.workbench import Workbench
from lightpen_resources import RESOURCES


class DataFolderPanel(Translated, QGroupBox):
    """Shows and opens the data folder."""

    change_requested = Signal()  # choose another folder

    def __init__(self, folder: Path, notifications: Notifications) -> None:
        super().__init__()
        self.say(self, self.tr("Data folder"))
        self._fault = ""

        # Widgets
        self._path = text_label(TextSize.SMALL, Tone.QUIET)
        self._path.setText(breakable(str(folder)))
        self._open = self.say(
            PushButton(),
            self.tr("Open folder"),
            name=self.tr("Open the data folder"),
            tip=self.tr("Location of swings and results"),
        )
        self._change = self.say(
            PushButton(),
            self.tr("Change..."),
            name=self.tr("Choose another data folder"),
            tip=self.tr(
                "Save swings and results in another folder from the next start."
            ),
        )
        self._doubt = SignLabel()

        # Layout
        layout = vertical_layout(self)
        fill(layout, self._path)
        horizontal_layout(layout, self._open, self._change, 1)
        fill(layout, self._doubt)

        # Connections
        self._open.clicked.connect(
            lambda: notifications.show_status(open_folder(folder))
        )
        self._change.clicked.connect(self.change_requested)

        self._refresh()

    def set_fault(self, fault: str) -> None:
        """Show why the folder cannot be written; an empty text ends it."""
        self._fault = fault
        self._refresh()

    def _refresh(self) -> None:
        self._change.setProperty("inviting", bool(self._fault))
        self._change.style().polish(self._change)
        doubt = StatusMessage.fault(breakable(self._fault))
        self._doubt.set_value(doubt if self._fault else StatusMessage())


TYPING_PAUSE_MS = 400  # after which what was typed is taken over


class SetupView(Translated, QWidget):
    """Setup of a station: fills the fields from the selection and applies entries."""

    edited = Signal()  # something is being typed; it may be unfinished
    done = Signal()  # show the day page
    welcome_requested = Signal()  # show how to begin

    def __init__(self, workbench: Workbench, *, is_known: bool) -> None:
        super().__init__()
        self._selection, self._watch = workbench.selection, workbench.library
        self._typing = QTimer(self, singleShot=True, interval=TYPING_PAUSE_MS)
        # Typed here, perhaps before the name of the tip: for a tip that is not known
        self._ball: float | None = None
        self._nominal_tip: FloatArray | None = None

        # Widgets: the order of making them is the order of the Tab key
        self.names, self.limits = NamesForm(), LimitsForm()
        self._assumed = AssumptionsDialog(self)
        self._assumptions = self.make_button(
            self.tr("Default uncertainties..."),
            self._assumed.open,
            tip=self.tr(
                "Focal length, scale, temperature, form of ball and cone: "
                "uncertainty where no file states it."
            ),
        )
        self.folder = DataFolderPanel(workbench.folder, workbench.notifications)
        self._more = self.say(PushButton(checkable=True), self.tr("More"))
        self._done = self.make_button(
            self.tr("Show the tips of this station"), self.done
        )
        self._welcome = self.make_button(
            self.tr("Other ways to begin"), self.welcome_requested
        )

        # Layout
        rows = vertical_layout(self, spacing=3 * GRID)
        self._columns = horizontal_layout(rows, spacing=3 * GRID)
        vertical_layout(
            self._columns,
            self.names,
            (self._more, 0, Qt.AlignmentFlag.AlignLeft),
            self.limits,
            (self._assumptions, 0, Qt.AlignmentFlag.AlignLeft),
            1,
            spacing=2 * GRID,
            stretch=5,
        )
        vertical_layout(self._columns, self.folder, 1, spacing=2 * GRID, stretch=4)
        horizontal_layout(rows, self._done, self._welcome, 1)
        rows.addStretch(1)

        # Connections
        self._more.toggled.connect(self.set_more)
        self.names.value_edited.connect(self._on_edited)
        self.names.value_changed.connect(self._take_names)
        self.names.item_chosen.connect(self.choose_item)
        self.names.ball_entered.connect(self._on_ball_entered)
        self.names.station_changed.connect(self._on_station_changed)
        self.names.nominal_tip_changed.connect(self._on_nominal_tip_changed)
        self.limits.value_changed.connect(self._on_limits_changed)
        self._assumed.value_changed.connect(self._on_assumed_changed)
        self._typing.timeout.connect(self._take_names)
        self._selection.changed.connect(self._on_selected)

        self.set_more(is_known)
        self._show_selected(self._selection.preparation)

    def lead(self) -> str:
        """Return what to enter."""
        return self.tr(
            "Enter what you are calibrating. Entries are saved for this station."
        )

    def set_narrow(self, narrow: bool) -> None:
        """Use one column where there is little width."""
        set_stacked(self._columns, narrow)

    def set_more(self, more: bool) -> None:
        """Show also what has a default."""
        self._more.setChecked(more)
        self.names.set_more(more)
        for each in (self.limits, self._assumptions, self.folder):
            each.setVisible(more)

    def set_why_not_done(self, why_not: str) -> None:
        """Show the missing inputs of the day page."""
        self._done.set_why_not(why_not)

    def typed(self) -> Preparation:
        """Return the selection with the names being typed."""
        return replace(self._selection.preparation, names=self.names.value())

    def why_not_on(self) -> str:
        """Return the missing input, or that the tip is retired."""
        typed = self.typed()
        missing = typed.start_missing_inputs()
        tip = self._watch.library.tip(typed.names.tip)
        if missing:
            return missing_input_text(missing[0])
        if tip is None or not tip.is_retired:
            return ""
        return self.tr(
            "Tip {0} is retired. Choose another tip, or reactivate it in the tip "
            "library."
        ).format(shortened(tip.id))

    def _on_edited(self) -> None:
        self._typing.start()
        self.edited.emit()

    def _take_names(self) -> None:
        """Apply all names but the station's, which may be incomplete."""
        self._typing.stop()
        now = self._selection.preparation
        names = replace(self.names.value(), station=now.names.station)
        if names == now.names:
            return
        renamed, listed = now.renamed(names), self._watch.library.tip(names.tip)
        if names.tip != now.names.tip:
            ball = renamed.names.ball_diameter or self._ball
            point = self._nominal_tip
            point = point if renamed.nominal_tip is None else renamed.nominal_tip
            names = replace(renamed.names, ball_diameter=ball)
            renamed = replace(renamed, names=names, nominal_tip=point)
            if listed is not None:
                renamed = renamed.with_listed(listed)
        self._selection.set_preparation(renamed)

    def _on_ball_entered(self, ball: float) -> None:
        self._ball = ball or None
        self._take_names()

    def forget_typed(self) -> None:
        """Keep what was typed for the tip that is chosen from another tip."""
        self._ball = self._nominal_tip = None

    def choose_item(self, kind: ItemKind, name: str) -> None:
        """Apply a selected pen, tip or cone; a tip with its properties."""
        self._take_names()
        now = self._selection.preparation
        tip = self._watch.library.tip(name)
        if kind is ItemKind.TIP and tip is not None:
            self.forget_typed()
            self._selection.set_preparation(now.with_listed(tip))
        elif kind is ItemKind.PEN:
            names = replace(now.names, pen=name)
            self._selection.set_preparation(replace(now, names=names))
        else:
            names = replace(now.names, cone=name)
            self._selection.set_preparation(replace(now, names=names))

    def ask_for_tip_again(self) -> None:
        """Ask for the tip again: the code belongs to another one."""
        self._take_names()
        now = self._selection.preparation
        self._selection.set_preparation(now.renamed(replace(now.names, tip="")))

    def _on_station_changed(self, name: str) -> None:
        """Bring back a known station; a new one takes over the present choices."""
        self._take_names()
        now = self._selection.preparation
        if name in self._selection.stations():
            self._selection.choose_station(name)
        else:
            if now.names.station and now.source.kind == SourceKind.SIMULATED:
                now = now.with_source(NO_SOURCE)  # only the station before simulates
            now = replace(now, names=replace(now.names, station=name))
            self._selection.set_preparation(now)
        self.names.set_stations(self._selection.stations())

    def _on_nominal_tip_changed(self) -> None:
        now, point = self._selection.preparation, self.names.nominal_tip()
        self._nominal_tip = point
        self._selection.set_preparation(replace(now, nominal_tip=point))

    def _on_limits_changed(self) -> None:
        now, limits = self._selection.preparation, self.limits.value()
        self._selection.set_preparation(replace(now, limits=limits))

    def _on_assumed_changed(self) -> None:
        now, assumed = self._selection.preparation, self._assumed.value()
        self._selection.set_preparation(now.with_assumptions(assumed))

    def settle(self) -> None:
        """Apply pending input."""
        self.names.settle()
        self.limits.settle()
        self._take_names()
        station = self.names.value().station
        if station != self._selection.preparation.names.station:
            self._on_station_changed(station)

    def _on_selected(self, before: Preparation) -> None:
        now = self._selection.preparation
        if now.names.tip not in (before.names.tip, self.names.value().tip):
            self.forget_typed()  # another was chosen elsewhere
        self._show_selected(now, before)

    def _show_selected(
        self, now: Preparation, before: Preparation | None = None
    ) -> None:
        """Update the fields that differ; others may be in use."""
        if before is None or now.names != before.names:
            self.names.set_value(now.names, None if before is None else before.names)
        if before is None or now.names.station != before.names.station:
            self.names.set_stations(self._selection.stations())
        if now.limits != self.limits.value():
            self.limits.set_value(now.limits)
        self.limits.set_guarded(self._selection.supervision.is_guarded)
        if now.assumptions_today != self._assumed.value():
            self._assumed.set_value(now.assumptions_today)
        if before is None or now.nominal_tip is not before.nominal_tip:
            self.names.set_nominal_tip(now.nominal_tip)
        if before is None or now.pen_file is not before.pen_file:
            pen = None if now.pen_file is None else now.pen_file.pen
            self.names.set_tip_of_file(None if pen is None else pen.nominal_tip)


LEAST_HEIGHT, LARGEST_HEIGHT = 10 * GRID, 22 * GRID  # px, of a picture
WORDS_HEIGHT = 21 * GRID  # px, with the margins


class WelcomeView(Translated, QWidget):
    """Offers a trial, recorded images, or the set-up of a station."""

    trial_ready = Signal()  # it can be swung
    trial_awaited = Signal()  # until its camera delivers an image
    station_begun = Signal()  # and is to be set up

    def __init__(self, workbench: Workbench) -> None:
        super().__init__()
        self._selection, self._run = workbench.selection, workbench.run
        self._camera, self._files = workbench.camera, workbench.files

        # Widgets
        self._trial = _Card(_Drawing("trial"))
        self._images = _Card(_Drawing("images"))
        self._station = _Card(_Drawing("station"))

        # Layout
        layout = vertical_layout(self)
        trials = (self._trial,) if workbench.around.simulator is not None else ()
        self._cards = (*trials, self._images, self._station)
        self.first: QWidget = self._cards[0]
        cards = ((each, 1) for each in self._cards)
        horizontal_layout(layout, *cards, spacing=3 * GRID)
        layout.addStretch(1)

        # Connections
        self._trial.clicked.connect(lambda: self._files.use_trial(self._begin_trial))
        self._images.clicked.connect(self._on_images_clicked)
        self._station.clicked.connect(lambda: self._begin_station())
        self._run.changed.connect(self._show_whether_free)

        self._refresh()

    def set_narrow(self, narrow: bool) -> None:
        """Use smaller pictures where there is little width."""
        for card in self._cards:
            card.set_narrow(narrow)

    def _on_images_clicked(self) -> None:
        dialog = QFileDialog(self, self.tr("Folder of the recorded images"))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(QFileDialog.FileMode.Directory)
        dialog.fileSelected.connect(self._begin_station)
        dialog.open()

    def lead(self) -> str:
        """Return what the program does."""
        return self.tr(
            "The tip rests in a cone while the pen is tilted to all sides; a camera "
            "observes the LEDs of the pen. The only point of the pen that does not "
            "move is the tip centre."
        )

    def _refresh(self) -> None:
        self._trial.set_words(
            self.tr("Try it with a simulated pen"),
            self.tr("The whole procedure without pen, camera or any entry."),
        )
        self._images.set_words(
            self.tr("Calibrate from recorded images"),
            self.tr("Choose a folder. Files of camera and LEDs in it are found."),
        )
        self._station.set_words(
            self.tr("Set up my station"),
            self.tr("Enter pen and tip, and choose the camera."),
        )
        self._show_whether_free()

    def _show_whether_free(self) -> None:
        """Show whether a trial can begin."""
        is_on = self._run.status.state is not None
        self._trial.set_why_not(self.tr("A swing is in progress.") if is_on else "")

    def _begin_trial(self) -> None:
        if not self._camera.live.is_open:
            self.trial_awaited.emit()
            self._camera.open()
        elif is_trial_ready(self._selection.preparation) and self.isVisible():
            self.trial_ready.emit()

    def _begin_station(self, images: str = "") -> None:
        """Set up a station, with recorded images or without a source."""
        names = self._selection.preparation.names
        if names.station in ("", TRIAL.station):
            self._selection.begin_station()
        if images:
            source = SourceChoice(SourceKind.RECORDED, images)
            chosen = self._selection.preparation.with_source(source)
            self._selection.set_preparation(chosen)
        self.station_begun.emit()


class _Card(PushButton):
    """A large button: picture, title and words."""

    def __init__(self, picture: QWidget) -> None:
        super().__init__()
        expanding = QSizePolicy.Policy.Expanding
        picture.setSizePolicy(expanding, expanding)
        self._picture = picture
        self._title = text_label(TextSize.LEAD)
        self._words = text_label(TextSize.BODY, Tone.QUIET)
        vertical_layout(self, picture, self._title, self._words, 1, margins=2 * GRID)
        for each in (picture, self._title, self._words):
            each.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def set_words(self, title: str, words: str) -> None:
        """Set title and words."""
        self.setAccessibleName(title)
        self._title.setText(title)
        self._words.setText(words)

    def set_narrow(self, narrow: bool) -> None:
        """Set the size of the picture, and by it the card's."""
        height = LEAST_HEIGHT if narrow else LARGEST_HEIGHT
        self._picture.setFixedHeight(height)
        self.setFixedHeight(height + WORDS_HEIGHT)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(20 * GRID, self.minimumHeight())


class _Drawing(QWidget):
    """A picture drawn in the colours of the window."""

    def __init__(self, name: str) -> None:
        super().__init__()
        file = RESOURCES / "pictures" / f"{name}.svg"
        self._picture = Template(file.read_text("utf-8"))

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        colors = asdict(colors_of(self.palette()))
        with QPainter(self) as painter:
            draw_svg(painter, QRectF(self.rect()), self._picture.substitute(colors))
