"""Replay recorded images as a live camera."""

import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from math import inf

from lightpen.arrays import Image
from lightpen.cameras.pairing import Clock, MachineClock
from lightpen.cameras.protocol import (
    EXPOSURE,
    GAIN,
    CameraCapabilities,
    CameraSettings,
    ConfigError,
    DeviceLost,
    DeviceNotFound,
    EndOfImages,
    Frame,
    FrameIncomplete,
    FrameTimeout,
    Range,
    Stats,
    sealed,
)
from lightpen.cameras.source import Source, SourceNeeds, SourcePlace
from lightpen.errors import FileError
from lightpen.formats.decoding import full_scale_of
from lightpen.formats.images import ImageSource, find_images
from lightpen.messages import Message, message, printable

FRAME_RATE = Range(0.1, inf)  # inf: as fast as asked
USUAL_FRAME_RATE = 20.0


class ReplayCamera:
    """Images of a source, one after the other, then the end.

    Each start begins with the first image. No image is lost, however late it is read.
    All have one size; images of 8 and 16 bits may be mixed.

    Parameters
    ----------
    where : str
        Folder, pattern or video; the serial number of this camera.
    find : callable, optional
        Returns the images; by default `find_images` looks ``where``.
    frame_rate : float
        1/s, at which the images come at most; `math.inf` for as fast as asked.
    loops : bool
        Whether the first image follows the last.
    """

    def __init__(
        self,
        where: str,
        find: Callable[[], ImageSource] | None = None,
        *,
        frame_rate: float = USUAL_FRAME_RATE,
        loops: bool = False,
        clock: Clock | None = None,
    ) -> None:
        self._where = where
        self._find = find or partial(find_images, where)
        self._frame_rate = FRAME_RATE.nearest(frame_rate)
        self._loops = loops
        self._clock = clock or MachineClock()
        self._stats = Stats()
        self._next_seq = 0
        self._next_due_ns = 0
        self._source: ImageSource | None = None
        self._capabilities: CameraCapabilities | None = None
        self._loaders: Iterator[Callable[[], Image]] | None = None
        self._n_unread = 0  # images in succession

    @property
    def serial(self) -> str:
        """Location of the images."""
        return self._where

    @property
    def caps(self) -> CameraCapabilities:
        """Capabilities of the camera."""
        if self._capabilities is None:
            raise ValueError("The camera is not open: call `open` first.")
        return self._capabilities

    def open(self) -> None:
        """Find the images; no-op if it is open."""
        if self._capabilities is not None:
            return
        try:
            source = self._find()
            (height, width), pixel_format = _usual_kind(source, self._where)
        except FileError as error:
            raise DeviceNotFound(error.message) from error
        self._source = source
        self._capabilities = CameraCapabilities(
            width=width,
            height=height,
            pixel_formats=(pixel_format,),
            frame_rate=FRAME_RATE,
            waits=True,
            n_images=len(source.names) if self._loops else None,
        )

    def close(self) -> None:
        """Stop and release the images."""
        self.stop()
        self._capabilities = self._source = None

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Set the frame rate before the start; return the actual settings."""
        (pixel_format,) = self.caps.pixel_formats
        if self._loaders is not None:
            raise ValueError("`configure` needs a stopped camera.")
        if settings.pixel_format not in {None, pixel_format}:
            raise ConfigError(
                "replay.pixel-format", found=pixel_format, wanted=settings.pixel_format
            )
        if settings.frame_rate is not None:
            self._frame_rate = FRAME_RATE.nearest(settings.frame_rate)
        return CameraSettings(frame_rate=self._frame_rate, pixel_format=pixel_format)

    def set_exposure(self, exposure_us: float) -> float:
        """Raise `ConfigError`: recorded images cannot be changed."""
        raise _already_taken(EXPOSURE)

    def set_gain(self, gain_db: float) -> float:
        """Raise `ConfigError`: recorded images cannot be changed."""
        raise _already_taken(GAIN)

    def start(self) -> None:
        """Start with the first image; no-op while streaming."""
        self.probe()
        if self._loaders is None:
            self._loaders = self._open_source()
            self._n_unread = 0
            self._next_due_ns = self._clock.now_ns()

    def stop(self) -> None:
        """Stop streaming; no-op if stopped."""
        self._loaders = None

    def read(self, timeout_s: float) -> Frame:
        """Return the next image, decoded now.

        Raises `FrameIncomplete` if it cannot be read, `DeviceLost` if no other can
        either.
        """
        if self._loaders is None:
            raise ValueError("The camera delivers no images: call `start` first.")
        self._await_turn(timeout_s)
        frame = self._decode(self._next_loader())
        self._stats = replace(self._stats, delivered=self._stats.delivered + 1)
        return frame

    def probe(self) -> None:
        """No-op: files are checked when they are read."""
        if self._capabilities is None:
            raise ValueError("The camera is not open: call `open` first.")

    def stats(self) -> Stats:
        """Return the frame counters."""
        return self._stats

    def _open_source(self) -> Iterator[Callable[[], Image]]:
        if self._source is None:
            raise ValueError("The camera is not open: call `open` first.")
        return self._source.open()

    def _await_turn(self, timeout_s: float) -> None:
        """Wait until it is time for the next image."""
        wait_s = (self._next_due_ns - self._clock.now_ns()) * 1e-9
        if wait_s > timeout_s:
            self._clock.wait(timeout_s)
            self._stats = replace(self._stats, timeouts=self._stats.timeouts + 1)
            raise FrameTimeout(
                "replay.later", place=self._where, seconds=wait_s - timeout_s
            )
        self._clock.wait(wait_s)

    def _next_loader(self) -> Callable[[], Image]:
        """Return the loader of the next image and set the time of the one after."""
        loaders, asked_ns = self._loaders or iter(()), self._clock.now_ns()
        loader = next(loaders, None)
        if loader is None and self._loops:
            self._loaders = self._open_source()
            loader = next(self._loaders, None)
        if loader is None:
            raise EndOfImages
        # The decoder of a video takes a while to start; no image makes up for it.
        now_ns = self._clock.now_ns()
        on_schedule = self._next_due_ns + round(1e9 / self._frame_rate)
        self._next_due_ns = max(on_schedule + now_ns - asked_ns, now_ns)
        return loader

    def _decode(self, loader: Callable[[], Image]) -> Frame:
        seq = self._next_seq
        self._next_seq += 1
        try:
            image = loader()
            _check_size(image, self._name(seq), self.caps)
        except FileError as error:
            self._stats = replace(self._stats, incomplete=self._stats.incomplete + 1)
            self._n_unread += 1
            if self._is_gone():
                raise DeviceLost("replay.lost", place=printable(self._where)) from error
            raise FrameIncomplete(error.message) from error
        self._n_unread = 0
        return Frame(
            image=sealed(image),
            seq=seq,
            host_ts_ns=self._clock.now_ns(),
            pixel_format=_pixel_format(image, self._stated),
            full_scale=self._stated or full_scale_of(image),
        )

    @property
    def _stated(self) -> int | None:
        """Full scale that the images state."""
        return None if self._source is None else self._source.full_scale

    def _name(self, seq: int) -> str:
        """Return the file of an image; after the last one comes the first."""
        names = () if self._source is None else self._source.names
        return printable(names[seq % len(names)]) if names else f"Image {seq + 1}"

    def _is_gone(self) -> bool:
        """Return whether the files are missing or none could be read in a round."""
        if self._source is None:
            return True
        files = self._source.files
        is_there = not files or any(os.access(file, os.R_OK) for file in files)
        return not is_there or self._n_unread >= len(self._source.names)


def _pixel_format(image: Image, full_scale: int | None) -> str:
    bits = 8 * image.itemsize
    return f"Mono{bits if full_scale is None else max(full_scale.bit_length(), 8)}"


def _usual_kind(source: ImageSource, where: str) -> tuple[tuple[int, ...], str]:
    """Return the first size that two images have, and the format of the first of them.

    So a bad image spoils nothing. Where no two are alike, it is the first image.
    """
    formats: dict[tuple[int, ...], str] = {}  # by size: height and width, px
    unread: FileError | None = None
    for loader in source.open():
        try:
            image = loader()
        except FileError as error:
            unread = unread or error
            continue
        if image.shape in formats:
            return image.shape, formats[image.shape]
        formats[image.shape] = _pixel_format(image, source.full_scale)
    if formats:
        return next(iter(formats.items()))
    raise unread or FileError("replay.no-images", place=where)


def _check_size(image: Image, name: str, caps: CameraCapabilities) -> None:
    height, width = image.shape
    if (width, height) != (caps.width, caps.height):
        raise FileError(
            "replay.other-size",
            name=name,
            width=width,
            height=height,
            usual_width=caps.width,
            usual_height=caps.height,
        )


def _already_taken(what: Message) -> ConfigError:
    return ConfigError("replay.already-taken", what=what)


def _camera(place: SourcePlace, clock: Clock) -> ReplayCamera:
    return ReplayCamera(place.name, loops=True, clock=clock)


RECORDED = Source("recorded", message("source.recorded"), SourceNeeds.FILES, _camera)
