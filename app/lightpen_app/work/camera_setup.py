"""The selected cameras: opening, search, and stored settings."""

import logging
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QObject, Signal

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import CameraInUse, CameraSettings
from lightpen.cameras.source import FoundDevice, Source, SourceNeeds
from lightpen.cameras.sources import source_named
from lightpen.formats.opened_files import CameraFile
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.live.sources import SourceEnvironment, cameras_of
from lightpen.swing.preparation import Preparation, SourceKind
from lightpen_app.look.words import shortened
from lightpen_app.work.job import LatestJob, Notifications, Report
from lightpen_app.work.live_view import DisplayedImage, LiveView
from lightpen_app.work.selection import Selection
from lightpen_app.work.settings import CameraFiles, Settings, circles_of, mask_of

_logger = logging.getLogger(__name__)


class CameraSetup(QObject):
    """Opens the selected source, and searches cameras.

    A camera that is open is closed while others are looked for: some libraries end the
    stream of one then.
    """

    cameras_found = Signal(object)  # tuple of FoundDevice
    search_failed = Signal(str)  # reason, text for the user
    all_found = Signal(object)  # tuple of Source and FoundDevice

    def __init__(
        self,
        selection: Selection,
        live: LiveView,
        settings: Settings,
        around: SourceEnvironment,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._selection = selection
        self._settings = settings
        self._around = around
        self._is_started = False
        self._search = LatestJob(self)
        self.live = live

        # Connections
        live.image_shown.connect(self._on_image_shown)
        live.configured.connect(self._on_configured)
        selection.changed.connect(self._on_selected)

    @property
    def sources(self) -> tuple[Source, ...]:
        """The sources to choose from."""
        return self._around.sources

    def open(self) -> None:
        """Open the source, or open it again after it failed; then follow its choice.

        A swing that is captured continues with it.
        """
        self._is_started = True
        source, *others = self._selection.preparation.sources
        if not self._around.has(source):
            self.live.close()
            return
        there = [other for other in others if self._around.has(other)]
        cameras = cameras_of([source, *there], self._around)
        clock, known = self._around.clock, self._settings.cameras()
        _logger.info("opening %s", [source, *there])
        self.live.open(cameras, CameraSettings(), clock, known)

    def search(self, kind: str, producer: str) -> None:
        """Search for the cameras of a source, with a GenTL producer if needed.

        An earlier search reports nothing any more.
        """
        source = source_named(kind)
        if source is None:
            return
        was_open = self.live.is_open
        self.live.close()
        find, live = source.find, self.live

        def search(_: Report) -> tuple[FoundDevice, ...]:
            live.await_closed()
            return find(producer)

        def open_again() -> None:
            if was_open and not live.is_open:
                self.open()

        self._search.start(
            search, self.cameras_found, self.search_failed, ended=open_again
        )

    def search_all(self) -> None:
        """Search the cameras of all sources, before one is chosen."""
        find = self._around.found_cameras
        self._search.start(lambda _: find(), self.all_found)

    def _on_selected(self, before: Preparation) -> None:
        now = self._selection.preparation
        if now.sources != before.sources and self._is_started:
            self.open()
        self.live.set_region(now.region)

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        size, now = (
            (shown.size.width(), shown.size.height()),
            self._selection.preparation,
        )
        if shown.seen.camera == 0 and size != now.image_size:
            self._selection.observe(replace(now, image_size=size))

    def _on_configured(self, camera: int, settings: CameraSettings) -> None:
        now, caps = self._selection.preparation, self.live.capabilities_of(camera)
        serial = self.live.serial_of(camera)
        used = CameraInUse(serial, settings)
        if camera == 0:
            now = replace(now, camera_in_use=used)
        elif now.second is not None and caps is not None:
            size = caps.width, caps.height
            now = replace(now, second=replace(now.second, in_use=used, image_size=size))
        else:
            return
        self._selection.observe(now)
        if now.sources[camera].source.needs is not SourceNeeds.FILES:
            self._settings.set_camera(serial, settings)


Opened = TypeVar("Opened", CameraFile, RigFile)
NO_FILES = {SourceKind.SIMULATED, SourceKind.RECORDED}


class FilesOfCameras(QObject):
    """Opens the files of the cameras in use, and stores which files they have.

    Simulated cameras and recorded images have their own files.
    """

    def __init__(
        self,
        selection: Selection,
        settings: Settings,
        notifications: Notifications,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._selection, self._settings = selection, settings
        self._notifications = notifications
        self._serials: tuple[str, ...] = ()
        self._job = LatestJob(self)

        # Connections
        selection.changed.connect(self._on_selected)

    def shut_down(self) -> None:
        """Cancel opening."""
        self._job.cancel()

    def _on_selected(self, before: Preparation) -> None:
        now = self._selection.preparation
        serials = serials_in_use(now)
        if not serials:
            self._serials = ()
        elif serials != self._serials:
            self._serials = serials
            self._open_own(now, serials)
        elif not self._job.is_running and _kept(now) != _kept(before):
            self._keep(now, serials)

    def _keep(self, now: Preparation, serials: tuple[str, ...]) -> None:
        """Store the files in use, unless they belong to another camera."""
        if len(serials) > 1:
            rig = "" if now.rig_file is None else str(now.rig_file.path)
            if rig:
                self._settings.set_camera_files(_pair(serials), CameraFiles(rig))
            if now.second is not None:
                self._store_mask(serials[1], now.second.mask)
            self._store_mask(serials[0], now.mask)
            return
        file = now.camera_file
        if file is None:
            self._store_mask(serials[0], now.mask)
            return
        owner = self._settings.camera_of_file(file.sha256)
        if owner not in ("", serials[0]):
            self._refuse(file, owner, serials[0])
            return
        self._notifications.withdraw(self)
        files = CameraFiles(str(file.path), file.sha256, circles_of(now.mask))
        self._settings.set_camera_files(serials[0], files)

    def _store_mask(self, serial: str, mask: FloatArray) -> None:
        files = self._settings.camera_files(serial)
        self._settings.set_camera_files(serial, replace(files, mask=circles_of(mask)))

    def _refuse(self, file: CameraFile, owner: str, serial: str) -> None:
        words = self.tr(
            "{0} is the intrinsics file of camera {1}, not of camera {2}. Open the "
            "file of this camera."
        ).format(file.path.name, shortened(owner), shortened(serial))
        now = self._selection.preparation
        self._selection.set_preparation(replace(now, camera_file=None))
        self._notifications.notify(self, words)

    def _open_own(self, now: Preparation, serials: tuple[str, ...]) -> None:
        """Use mask and files of the cameras that are open now."""
        self._notifications.withdraw(self)
        self._job.cancel()
        own = [self._settings.camera_files(serial) for serial in serials]
        if own[0] != CameraFiles():
            now = replace(now, mask=mask_of(own[0].mask))
        if now.second is not None and len(own) > 1 and own[1] != CameraFiles():
            now = replace(now, second=replace(now.second, mask=mask_of(own[1].mask)))
        self._selection.observe(now)
        if len(serials) > 1:
            rig = self._settings.camera_files(_pair(serials)).file
            if rig and (now.rig_file is None or str(now.rig_file.path) != rig):
                self._read(partial(read_rig, Path(rig)), self._on_rig_read)
            elif now.rig_file is not None:
                self._keep(now, serials)
            return
        in_use = "" if now.camera_file is None else now.camera_file.sha256
        if own[0].file and own[0].sha256 != in_use:
            path = Path(own[0].file)
            self._read(partial(CameraFile.read, path), self._on_file_read)
        elif now.camera_file is not None:
            self._keep(now, serials)

    def _read(self, read: Callable[[], Opened], take: Callable[[Opened], None]) -> None:
        serials = self._serials

        def on_read(opened: Opened) -> None:
            if self._serials == serials:
                take(opened)

        on_unread = partial(self._notifications.notify, self)
        self._job.start(lambda _: read(), on_read, on_unread)

    def _on_file_read(self, file: CameraFile) -> None:
        now = self._selection.preparation
        self._selection.set_preparation(replace(now, camera_file=file))

    def _on_rig_read(self, file: RigFile) -> None:
        self._selection.set_preparation(self._selection.preparation.with_rig(file))


def serials_in_use(now: Preparation) -> tuple[str, ...]:
    """Return the serial numbers of the cameras in use; none until all are open."""
    if any(source.kind in NO_FILES for source in now.sources):
        return ()
    in_use = [now.camera_in_use]
    if now.second is not None:
        in_use.append(now.second.in_use)
    serials = tuple(each.serial for each in in_use if each is not None)
    return serials if len(serials) == len(in_use) and all(serials) else ()


def _pair(serials: tuple[str, ...]) -> str:
    return " + ".join(serials)


def _kept(now: Preparation) -> tuple[object, ...]:
    second = None if now.second is None else circles_of(now.second.mask)
    return now.camera_file, now.rig_file, circles_of(now.mask), second
