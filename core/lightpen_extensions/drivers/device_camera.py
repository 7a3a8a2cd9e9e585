"""A real camera behind the common protocol, for any library.

The library is a `Device`: it opens and closes, hands on what arrives, and reaches the
camera's features. What all cameras share is done here: settings, numbers and times of
images, their counts, and grey values at full depth.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Protocol

from lightpen.cameras.pairing import Clock, MachineClock
from lightpen.cameras.pixel_formats import pixel_format_named
from lightpen.cameras.protocol import (
    EXPOSURE,
    GAIN,
    CameraCapabilities,
    CameraSettings,
    ConfigError,
    Frame,
    FrameIncomplete,
    FrameTimeout,
    Stats,
    TriggerMode,
    lost,
    sealed,
)
from lightpen.messages import Message
from lightpen_extensions.drivers.features import (
    EXPOSURES,
    GAINS,
    Features,
    apply_settings,
    read_capabilities,
    read_settings,
    set_nearest,
)
from lightpen_extensions.drivers.pixels import Bytes, decoded

SETTLING = 0.4  # s in which images with the previous exposure may arrive
LOST_TRIGGER = 1.0  # s beyond the exposure without an image; it is given again
LAST_SHORT_NUMBER = 65_535  # of GigE Vision 1; 1 follows, as 0 is left out
MOST_MISSED = 10_000  # at once; a larger gap is a restarted frame counter


@dataclass(frozen=True, eq=False)
class DeliveredFrame:
    """An image as a library delivers it."""

    data: Bytes  # (N,), a copy of the sent bytes
    width: int
    height: int
    number: int  # frame number of the camera
    device_ts_ns: int | None = None
    padding: int = 0  # bytes at the end of each row
    is_complete: bool = True  # whether all of it arrived


class Device(Protocol):
    """A camera as a library drives it; every call is made by one thread.

    All but `close` may raise `DeviceLost` while it is open.
    """

    @property
    def serial(self) -> str:
        """Serial number, or the address until it is open."""

    @property
    def features(self) -> Features:
        """The features of the open camera."""

    def open(self) -> None:
        """Open the camera, or raise `DeviceNotFound` or `DeviceBusy`."""

    def close(self) -> None:
        """Release everything; safe to call twice and on a lost camera."""

    def start(self) -> None:
        """Start streaming."""

    def stop(self) -> None:
        """Stop streaming, also of a dead camera."""

    def fetch(self, timeout_s: float) -> DeliveredFrame | None:
        """Return the next image; None after the timeout."""

    def probe(self) -> None:
        """Raise an error unless the camera responds."""


class DeviceCamera:
    """A camera that a library drives, with a device that is not open."""

    def __init__(self, device: Device, clock: Clock | None = None) -> None:
        self._device = device
        self._clock = clock or MachineClock()
        self._capabilities: CameraCapabilities | None = None
        self._settings = CameraSettings()
        self._is_streaming = False
        self._stats = Stats()
        self._next_seq = 0
        self._last_number: int | None = None  # since the start
        self._settled_ns = 0
        self._next_trigger_ns = 0
        self._lost_ns = 0  # until then the image of the last trigger is waited for

    @property
    def serial(self) -> str:
        """Serial number or address of the device."""
        return self._device.serial

    @property
    def caps(self) -> CameraCapabilities:
        """Capabilities with the current settings."""
        if self._capabilities is None:
            raise ValueError("The camera is not open: call `open` first.")
        return self._capabilities

    def open(self) -> None:
        """Find and open the camera; no-op if it is open."""
        if self._capabilities is None:
            self._device.open()
            self._refresh()

    def close(self) -> None:
        """Stop and close the camera."""
        self.stop()
        self._capabilities = None
        self._device.close()

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply settings before the start; return the actual ones."""
        self._check_open()
        if self._is_streaming:
            raise ValueError("`configure` needs a stopped camera.")
        apply_settings(self._device.features, settings)
        self._refresh()
        return self._settings

    def set_exposure(self, exposure_us: float) -> float:
        """Set the exposure, also while streaming; return the actual one, us."""
        applied = self._set(EXPOSURE, EXPOSURES, exposure_us)
        self._settings = replace(self._settings, exposure_us=applied)
        return applied

    def set_gain(self, gain_db: float) -> float:
        """Set the gain, also while streaming; return the actual one, dB."""
        applied = self._set(GAIN, GAINS, gain_db)
        self._settings = replace(self._settings, gain_db=applied)
        return applied

    def start(self) -> None:
        """Start streaming; no-op while streaming."""
        self._check_open()
        if self._is_streaming:
            return
        self._device.start()
        self._is_streaming = True
        self._last_number = None
        now_ns = self._clock.now_ns()
        self._next_trigger_ns = self._lost_ns = self._settled_ns = now_ns

    def stop(self) -> None:
        """Stop streaming; no-op if stopped."""
        if self._is_streaming:
            self._is_streaming = False
            self._device.stop()

    def read(self, timeout_s: float) -> Frame:
        """Return the next complete image."""
        self._check_open()
        if not self._is_streaming:
            raise ValueError("The camera delivers no images: call `start` first.")
        delivery = self._fetch(timeout_s)
        if delivery is None:
            self._stats = replace(self._stats, timeouts=self._stats.timeouts + 1)
            raise FrameTimeout("camera.no-image", serial=self.serial, waited=timeout_s)
        seq = self._seq(delivery.number)
        if not self._is_whole(delivery):
            self._stats = replace(self._stats, incomplete=self._stats.incomplete + 1)
            raise FrameIncomplete("camera.incomplete", seq=seq, serial=self.serial)
        self._stats = replace(self._stats, delivered=self._stats.delivered + 1)
        return self._frame(delivery, seq)

    def probe(self) -> None:
        """Raise an error unless the camera responds."""
        self._check_open()
        self._device.probe()

    def stats(self) -> Stats:
        """Return the frame counters."""
        return self._stats

    def _check_open(self) -> None:
        if self._capabilities is None:
            raise ValueError("The camera is not open: call `open` first.")

    def _refresh(self) -> None:
        features = self._device.features
        self._capabilities = replace(read_capabilities(features), has_link=True)
        self._settings = read_settings(features, self._capabilities)

    def _set(self, what: Message, names: tuple[str, ...], value: float) -> float:
        self._check_open()
        self._settled_ns = self._clock.now_ns() + round(SETTLING * 1e9)
        applied = set_nearest(self._device.features, names, value)
        if applied is None:
            raise ConfigError("camera.cannot-be-set", what=what)
        return applied

    def _fetch(self, timeout_s: float) -> DeliveredFrame | None:
        if self._settings.trigger is not TriggerMode.SOFTWARE:
            return self._device.fetch(timeout_s)
        now_ns = self._clock.now_ns()
        deadline_ns = now_ns + round(timeout_s * 1e9)
        while True:
            if now_ns >= self._lost_ns:
                trigger_ns = min(self._next_trigger_ns, deadline_ns)
                self._clock.wait((trigger_ns - now_ns) * 1e-9)
                if self._next_trigger_ns > deadline_ns:
                    return None
                self._trigger()
            until_ns = min(self._lost_ns, deadline_ns)
            wait_s = (until_ns - self._clock.now_ns()) * 1e-9
            delivery = self._device.fetch(max(wait_s, 0.0))
            now_ns = self._clock.now_ns()
            if delivery is not None:
                self._lost_ns = now_ns
                return delivery
            if now_ns >= deadline_ns:
                return None

    def _trigger(self) -> None:
        now_ns = self._clock.now_ns()
        rate, exposure_us = self._settings.frame_rate, self._settings.exposure_us
        self._next_trigger_ns = now_ns + (round(1e9 / rate) if rate else 0)
        self._lost_ns = now_ns + round(1e9 * LOST_TRIGGER + 1e3 * (exposure_us or 0.0))
        self._device.features.execute("TriggerSoftware")

    def _seq(self, number: int) -> int:
        """Return the sequence number of an image since the camera was made."""
        last, self._last_number = self._last_number, number
        step = 1
        if last is not None:
            step = number - last
            if step <= 0 and last <= LAST_SHORT_NUMBER:
                step += LAST_SHORT_NUMBER
            if not 0 < step <= MOST_MISSED:
                step = 1
        self._stats = replace(self._stats, missed=self._stats.missed + step - 1)
        seq = self._next_seq + step - 1
        self._next_seq = seq + 1
        return seq

    def _is_whole(self, delivery: DeliveredFrame) -> bool:
        """Return whether an image is complete, independently of the library."""
        pixel_format = pixel_format_named(self._settings.pixel_format or "")
        caps = self.caps
        return (
            delivery.is_complete
            and pixel_format is not None
            and (delivery.width, delivery.height) == (caps.width, caps.height)
            and len(delivery.data)
            >= pixel_format.size(caps.width, caps.height, delivery.padding)
        )

    def _frame(self, delivery: DeliveredFrame, seq: int) -> Frame:
        pixel_format = pixel_format_named(self._settings.pixel_format or "")
        assert pixel_format is not None
        now_ns = self._clock.now_ns()
        is_settled = now_ns >= self._settled_ns
        return Frame(
            image=sealed(
                decoded(
                    delivery.data,
                    delivery.width,
                    delivery.height,
                    pixel_format,
                    delivery.padding,
                )
            ),
            seq=seq,
            host_ts_ns=now_ns,
            device_ts_ns=delivery.device_ts_ns,
            exposure_us=self._settings.exposure_us if is_settled else None,
            gain_db=self._settings.gain_db if is_settled else None,
            pixel_format=pixel_format.name,
            full_scale=pixel_format.full_scale,
        )


def setting_refused(serial: str, why: str) -> ConfigError:
    """Return the error of a refused setting."""
    return ConfigError("camera.refused", serial=serial, why=why)


@contextmanager
def in_sentences(
    serial: str,
    refusals: tuple[type[Exception], ...],
    losses: tuple[type[Exception], ...],
) -> Iterator[None]:
    """Convert exceptions of a library to refused settings and lost cameras."""
    try:
        yield
    except refusals as error:
        raise setting_refused(serial, str(error)) from error
    except losses as error:
        raise lost(serial, str(error)) from error
