"""The selected files, read in the background, with reasons for failures."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, QStandardPaths

from lightpen.formats.opened_files import OpenedFiles, open_files
from lightpen.live.sources import SourceEnvironment
from lightpen.record.exports import export_stem
from lightpen.record.swings.solving import FilesBeside
from lightpen.swing.preparation import Preparation, SourceChoice, SourceKind
from lightpen_app.look.languages import worded
from lightpen_app.work.job import Job, Notifications, Report
from lightpen_app.work.selection import Selection, trial_of
from lightpen_app.work.settings import FilePaths, Settings
from lightpen_app.work.swing_run import SwingRun


class ChosenFiles(QObject):
    """Reads the files of a station, those beside images, and samples.

    One reading at a time; an earlier one reports nothing any more. ``samples`` is the
    folder for the files of the simulated camera.
    """

    def __init__(
        self,
        selection: Selection,
        notifications: Notifications,
        samples: Path,
        around: SourceEnvironment,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._selection = selection
        self._notifications = notifications
        self._samples = samples
        self._around = around
        self._job: Job | None = None
        self._faults: tuple[object, ...] = ()

        # Connections
        selection.station_changed.connect(self._read_station)
        selection.changed.connect(self._on_selected)

    @property
    def is_reading(self) -> bool:
        """Whether files are being read, or sample files written."""
        return self._job is not None

    def start(self) -> None:
        """Use the sample files if the last station has no others."""
        if self._job is None:
            self._fill_in_samples()
        else:
            self._job.succeeded.connect(self._fill_in_samples)

    def use_samples(self) -> None:
        """Choose the files that go with the simulated camera, once they are written."""
        self._withdraw()
        self._read_samples()

    def use_trial(self, begin: Callable[[], None]) -> None:
        """Choose a trial with its simulated pen, once the files are written; begin."""

        def on_read(opened: OpenedFiles) -> None:
            self._selection.set_preparation(
                replace(
                    trial_of(self._selection.preparation),
                    camera_file=opened.camera_file,
                    pen_file=opened.pen_file,
                )
            )
            begin()

        self._withdraw()
        self._read(self._write_samples, on_read, brings_source=True)

    def use_files(self, files: FilesBeside) -> None:
        """Select the files beside recorded images once they are read."""
        self._withdraw()
        self._read(lambda _: open_files(files.camera, files.pen), self._on_chosen_read)

    def _read_samples(self) -> None:
        self._read(self._write_samples, self._on_chosen_read)

    def _write_samples(self, _: Report) -> OpenedFiles:
        simulator = self._around.simulator
        return simulator.write_files(self._samples) if simulator else OpenedFiles()

    def _read_station(self, files: FilePaths) -> None:
        """Read the files of a station; what cannot be read must be chosen again."""
        self._withdraw()
        self._cancel()
        paths = [
            Path(path) if path else None
            for path in (files.camera, files.pen, files.rig)
        ]
        if any(paths):
            camera, pen, rig = paths
            self._read(
                lambda _: open_files(camera, pen, files.pen_units or None, rig),
                self._on_station_read,
            )

    def _read(
        self,
        function: Callable[[Report], OpenedFiles],
        take: Callable[[OpenedFiles], None],
        *,
        brings_source: bool = False,
    ) -> None:
        self._cancel()
        self._job = job = Job(function, self)
        source = self._selection.preparation.source

        def on_read(opened: OpenedFiles) -> None:
            self._job = None
            faults = opened.faults
            if not brings_source:
                opened = _of_source(opened, source, self._selection.preparation)
            take(opened)
            self._show_faults(*map(worded, faults))

        job.start(on_read, self._on_failed)

    def _fill_in_samples(self) -> None:
        now = self._selection.preparation
        simulated = now.source.kind == SourceKind.SIMULATED
        if simulated and now.camera_file is None and now.pen_file is None:
            self._read_samples()

    def _on_station_read(self, opened: OpenedFiles) -> None:
        self._selection.forget_unread()
        now = self._selection.preparation  # files chosen meanwhile count
        now = replace(
            now,
            camera_file=now.camera_file or opened.camera_file,
            pen_file=now.pen_file or opened.pen_file,
        ).with_rig(now.rig_file or opened.rig_file)
        self._selection.observe(now)

    def _on_chosen_read(self, opened: OpenedFiles) -> None:
        now = self._selection.preparation
        now = replace(
            now,
            camera_file=opened.camera_file or now.camera_file,
            pen_file=opened.pen_file or now.pen_file,
        ).with_rig(opened.rig_file or now.rig_file)
        self._selection.set_preparation(now)

    def _on_failed(self, sentence: str) -> None:
        self._job = None
        self._show_faults(sentence)

    def _on_selected(self, before: Preparation) -> None:
        if _files(before) != _files(self._selection.preparation):
            self._withdraw()

    def _show_faults(self, *sentences: str) -> None:
        self._faults = tuple((self, i) for i in range(len(sentences)))
        for cause, sentence in zip(self._faults, sentences, strict=True):
            self._notifications.notify(cause, sentence)

    def _withdraw(self) -> None:
        """Take back why files were not chosen: others are."""
        self._notifications.withdraw(*self._faults)

    def _cancel(self) -> None:
        job, self._job = self._job, None
        if job is not None:
            job.cancel()


def _files(preparation: Preparation) -> tuple[object, ...]:
    return preparation.camera_file, preparation.pen_file, preparation.rig_file


def _of_source(
    opened: OpenedFiles, source: SourceChoice, now: Preparation
) -> OpenedFiles:
    """Return the files read for a source, unless the selection overrides them."""
    held = replace(
        now, source=source, camera_file=opened.camera_file, pen_file=opened.pen_file
    ).with_source(now.source)
    return replace(opened, camera_file=held.camera_file, pen_file=held.pen_file)


@dataclass(frozen=True)
class SavePlace:
    """The folder that was chosen last, and names by pen, tip and date."""

    # Remembers the folder, and the laboratory that a certificate names.
    settings: Settings
    run: SwingRun
    # Returns the date and time of a result that is not accepted yet.
    now: Callable[[], datetime]

    def folder(self) -> Path:
        """Return the last folder; at first the user's documents."""
        chosen = self.settings.last().export_folder
        if chosen:
            return Path(chosen)
        documents = QStandardPaths.StandardLocation.DocumentsLocation
        return Path(QStandardPaths.writableLocation(documents))

    def remember(self, folder: Path) -> None:
        """Offer this folder from now on."""
        self.settings.set_last(export_folder=str(folder))

    def stem(self) -> str:
        """Return the beginning of a file name."""
        status = self.run.status
        moment = self.now() if status.result is None else status.result.accepted
        return export_stem(status.names, moment, status.origin)
