"""Intrinsics, mask and rig file, kept with the serial numbers of the cameras."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from PySide6.QtCore import QObject

from lightpen.arrays import FloatArray
from lightpen.formats.opened_files import CameraFile
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.swing.image_sources import SourceKind
from lightpen.swing.preparation import Preparation
from lightpen_app.look.words import shortened
from lightpen_app.work.job import LatestJob
from lightpen_app.work.notifications import Notifications
from lightpen_app.work.selection import Selection
from lightpen_app.work.settings import Settings
from lightpen_app.work.stations import CameraFiles, Triple

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
        files = CameraFiles(str(file.path), file.sha256, _circles(now.mask))
        self._settings.set_camera_files(serials[0], files)

    def _store_mask(self, serial: str, mask: FloatArray) -> None:
        files = self._settings.camera_files(serial)
        self._settings.set_camera_files(serial, replace(files, mask=_circles(mask)))

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
            now = replace(now, mask=_array(own[0].mask))
        if now.second is not None and len(own) > 1 and own[1] != CameraFiles():
            now = replace(now, second=replace(now.second, mask=_array(own[1].mask)))
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
    second = None if now.second is None else _circles(now.second.mask)
    return now.camera_file, now.rig_file, _circles(now.mask), second


def _circles(mask: FloatArray) -> tuple[Triple, ...]:
    return tuple((x, y, radius) for x, y, radius in mask.tolist())


def _array(mask: tuple[Triple, ...]) -> FloatArray:
    return np.array(mask).reshape(-1, 3)
