"""The selected cameras: opening, search, and stored settings."""

import logging
from dataclasses import replace

from PySide6.QtCore import QObject, Signal

from lightpen.cameras.protocol import CameraSettings
from lightpen.cameras.source import FoundDevice, Source, SourceNeeds
from lightpen.cameras.sources import source_named
from lightpen.live.sources import SourceEnvironment, cameras_of
from lightpen.swing.image_sources import CameraInUse
from lightpen.swing.preparation import Preparation
from lightpen_app.work.job import LatestJob, Report
from lightpen_app.work.live_images import DisplayedImage
from lightpen_app.work.live_view import LiveView
from lightpen_app.work.selection import Selection
from lightpen_app.work.settings import Settings

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
