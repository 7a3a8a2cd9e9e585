"""Entries of the step Start, as fields and as the selection."""

from dataclasses import replace

from PySide6.QtCore import QCoreApplication, QObject, QTimer, Signal

from lightpen.record.library.tip_library import ItemKind
from lightpen.swing.image_sources import NO_SOURCE, SourceKind
from lightpen.swing.preparation import Preparation
from lightpen_app.look.phrases import missing_input_text
from lightpen_app.look.words import shortened
from lightpen_app.steps.start.assumptions_panel import AssumptionsPanel
from lightpen_app.steps.start.form import LimitsForm, NamesForm
from lightpen_app.steps.start.library_control import LibraryControl
from lightpen_app.work.selection import Selection

TYPING_PAUSE_MS = 400  # after which what was typed is taken over


class EntryPresenter(QObject):
    """Fills the fields from the selection and applies entries."""

    edited = Signal()  # something is being typed; it may be unfinished

    def __init__(
        self,
        selection: Selection,
        library: LibraryControl,
        names: NamesForm,
        limits: LimitsForm,
        assumed: AssumptionsPanel,
    ) -> None:
        super().__init__(names)
        self._selection, self._library = selection, library
        self._names, self._limits, self._assumed = names, limits, assumed
        self._typing = QTimer(self, singleShot=True, interval=TYPING_PAUSE_MS)

        # Connections
        names.value_edited.connect(self._on_edited)
        names.value_changed.connect(self._take_names)
        names.station_changed.connect(self._on_station_changed)
        names.nominal_tip_changed.connect(self._on_nominal_tip_changed)
        library.chosen.connect(self._on_item_chosen)
        library.unknown_declined.connect(self._on_unknown_declined)
        limits.value_changed.connect(self._on_limits_changed)
        assumed.value_changed.connect(self._on_assumed_changed)
        self._typing.timeout.connect(self._take_names)
        selection.changed.connect(self._on_selected)

        self._show(selection.preparation)

    def typed(self) -> Preparation:
        """Return the selection with the names being typed."""
        return replace(self._selection.preparation, names=self._names.value())

    def why_not_on(self) -> str:
        """Return the missing input, or that the tip is retired."""
        typed = self.typed()
        missing = typed.start_missing_inputs()
        tip = self._library.tip(typed.names.tip)
        if missing:
            return missing_input_text(missing[0])
        if tip is None or not tip.is_retired:
            return ""
        return QCoreApplication.translate(
            "StartPage",
            "Tip {0} is retired. Choose another tip, or reactivate it in the tip "
            "library.",
        ).format(shortened(tip.id))

    def _on_edited(self) -> None:
        self._typing.start()
        self.edited.emit()

    def _take_names(self) -> None:
        """Apply all names but the station's, which may be incomplete."""
        self._typing.stop()
        now = self._selection.preparation
        names = replace(self._names.value(), station=now.names.station)
        if names == now.names:
            return
        is_other = names.tip != now.names.tip
        renamed, listed = now.renamed(names), self._library.tip(names.tip)
        is_bare = renamed.names.ball_diameter is None
        if is_other and listed is not None and is_bare:
            renamed = renamed.with_listed(listed)
        self._selection.set_preparation(renamed)

    def _on_item_chosen(self, kind: ItemKind, name: str) -> None:
        """Apply a selected pen, tip or cone; a tip with its properties."""
        self._take_names()
        now = self._selection.preparation
        tip = self._library.tip(name)
        if kind is ItemKind.TIP and tip is not None:
            self._selection.set_preparation(now.with_listed(tip))
        elif kind is ItemKind.PEN:
            names = replace(now.names, pen=name)
            self._selection.set_preparation(replace(now, names=names))
        else:
            names = replace(now.names, cone=name)
            self._selection.set_preparation(replace(now, names=names))

    def _on_unknown_declined(self) -> None:
        """Ask for the tip again: the barcode belongs to another one."""
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
        self._names.set_stations(self._selection.stations())

    def _on_nominal_tip_changed(self) -> None:
        now, point = self._selection.preparation, self._names.nominal_tip()
        self._selection.set_preparation(replace(now, nominal_tip=point))

    def _on_limits_changed(self) -> None:
        now, limits = self._selection.preparation, self._limits.value()
        self._selection.set_preparation(replace(now, limits=limits))

    def _on_assumed_changed(self) -> None:
        now, assumed = self._selection.preparation, self._assumed.value()
        self._selection.set_preparation(now.with_assumptions(assumed))

    def settle(self) -> None:
        """Apply pending input."""
        self._names.settle()
        self._limits.settle()
        self._take_names()
        station = self._names.value().station
        if station != self._selection.preparation.names.station:
            self._on_station_changed(station)

    def _on_selected(self, before: Preparation) -> None:
        self._show(self._selection.preparation, before)

    def _show(self, now: Preparation, before: Preparation | None = None) -> None:
        """Update the fields that differ; others may be in use."""
        if before is None or now.names != before.names:
            self._typing.stop()
            names = now.names
            if before is not None and names.station == before.names.station:
                names = replace(names, station=self._names.value().station)
            self._names.set_value(names)
        if before is None or now.names.station != before.names.station:
            self._names.set_stations(self._selection.stations())
        if now.limits != self._limits.value():
            self._limits.set_value(now.limits)
        self._limits.set_guarded(self._selection.supervision.is_guarded)
        if now.assumptions_today != self._assumed.value():
            self._assumed.set_value(now.assumptions_today)
        if before is None or now.nominal_tip is not before.nominal_tip:
            self._names.set_nominal_tip(now.nominal_tip)
        if before is None or now.pen_file is not before.pen_file:
            pen = None if now.pen_file is None else now.pen_file.pen
            self._names.set_tip_of_file(None if pen is None else pen.nominal_tip)
