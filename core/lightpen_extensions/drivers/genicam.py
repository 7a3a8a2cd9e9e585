"""GenICam cameras by the GenTL producer of their vendor.

A producer is a file ``.cti`` that comes with the software of a camera. Harvesters runs
it. Its quirks, each seen: it passes over producers that do not load; its waiting call
keeps every other thread of Python from running; `update` ends a stream that runs; and a
harvester that lost its camera finds it no more.
"""

import os
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from lightpen.cameras.pairing import Clock
from lightpen.cameras.protocol import DeviceNotFound, Range, busy, not_found
from lightpen.cameras.source import FoundDevice, Source, SourceNeeds, SourcePlace
from lightpen.messages import Message, message
from lightpen_extensions.drivers.device_camera import (
    DeliveredFrame,
    DeviceCamera,
    in_sentences,
)

WRITE_ONLY, READ_WRITE = 2, 4  # of EAccessMode; a command is write-only
PRODUCERS = "GENICAM_GENTL64_PATH"  # folders, as the GenTL standard names them
SUFFIX = ".cti"
N_BUFFERS = 16  # images in transit; each buffer is returned once copied
POLL = 0.002  # s that a call may keep the other threads waiting
PAUSE = 0.003  # s between two calls


class GenicamFeatures:
    """The features of an open camera by its nodes, with errors as messages."""

    def __init__(self, nodes: Any, serial: str) -> None:
        self._nodes = nodes
        self._serial = serial

    def has(self, name: str) -> bool:
        """Return whether the camera has a feature that is available now."""
        with _converting_errors(self._serial):
            if not self._nodes.has_node(name):
                return False
            access = int(self._nodes.get_node(name).get_access_mode())
            return access in (WRITE_ONLY, READ_WRITE)

    def number(self, name: str) -> float:
        """Return the value of a number."""
        return float(self._read(name, "value"))

    def limits(self, name: str) -> Range:
        """Return the present range of a number."""
        low, high = self._read(name, "min"), self._read(name, "max")
        # What a float is rounded to is seen when it is read back.
        step = self._read(name, "inc") if isinstance(low, int) else 0.0
        return Range(float(low), float(high), float(step))

    def choice(self, name: str) -> str:
        """Return the current entry of an enumeration."""
        return str(self._read(name, "value"))

    def choices(self, name: str) -> tuple[str, ...]:
        """Return the entries of an enumeration that can be chosen now."""
        return tuple(map(str, self._read(name, "symbolics")))

    def set(self, name: str, value: float | str | bool) -> None:
        """Set a number within its limits, an entry of an enumeration or a switch."""
        if not isinstance(value, (str, bool)):
            is_integer = isinstance(self._read(name, "value"), int)
            value = round(value) if is_integer else float(value)
        with _converting_errors(self._serial):
            self._nodes.get_node(name).value = value

    def execute(self, name: str) -> None:
        """Execute a command."""
        with _converting_errors(self._serial):
            self._nodes.get_node(name).execute()

    def _read(self, name: str, what: str) -> Any:
        with _converting_errors(self._serial):
            return getattr(self._nodes.get_node(name), what)


class GenicamDevice:
    """A camera that a GenTL producer drives."""

    def __init__(self, place: SourcePlace) -> None:
        self.serial = place.name  # or an ID of the producer
        self._producer = place.producer
        self._harvester: Any = None
        self._acquirer: Any = None
        self._features: GenicamFeatures | None = None

    @property
    def features(self) -> GenicamFeatures:
        """The features of the open camera."""
        assert self._features is not None
        return self._features

    def open(self) -> None:
        """Open the camera."""
        if not _is_installed():
            raise DeviceNotFound(_ABSENT)
        self._harvester = harvester = _harvester(self._producer)
        from genicam import gentl

        name = self.serial
        try:
            indices = [
                index
                for index, info in enumerate(harvester.device_info_list)
                if name in (info.serial_number, info.id_)
            ]
            if not indices:
                raise not_found(name)
            self._acquirer = acquirer = harvester.create(indices[0])
        except (
            gentl.ResourceInUseException,
            gentl.AccessDeniedException,
            gentl.BusyException,
        ) as error:
            self.close()
            raise busy(name) from error
        except gentl.GenericException as error:
            self.close()
            raise not_found(name, str(error)) from error
        except DeviceNotFound:
            self.close()
            raise
        acquirer.num_buffers = max(N_BUFFERS, acquirer.min_num_buffers)
        self._features = GenicamFeatures(acquirer.remote_device.node_map, name)

    def close(self) -> None:
        """Close the camera and the producer."""
        self._features = None
        acquirer, self._acquirer = self._acquirer, None
        harvester, self._harvester = self._harvester, None
        if acquirer is not None:
            _quietly(acquirer.stop)
            _quietly(acquirer.destroy)
        if harvester is not None:
            _quietly(harvester.reset)

    def start(self) -> None:
        """Start streaming."""
        with _converting_errors(self.serial):
            self._acquirer.start()

    def stop(self) -> None:
        """Stop streaming."""
        _quietly(self._acquirer.stop)

    def fetch(self, timeout_s: float) -> DeliveredFrame | None:
        """Return the next image; None after the timeout."""
        end = time.monotonic() + timeout_s
        with _converting_errors(self.serial):
            while (buffer := self._acquirer.try_fetch(timeout=POLL)) is None:
                if time.monotonic() >= end:
                    return None
                time.sleep(PAUSE)
            with buffer:
                return _delivery(buffer.module)

    def probe(self) -> None:
        """Raise an error unless the camera responds."""
        self.features.number("Width")


def _delivery(module: Any) -> DeliveredFrame:
    from genicam import gentl

    try:
        device_ts_ns = module.timestamp_ns
    except gentl.GenericException:  # not every producer has one
        device_ts_ns = None
    size = module.size_filled - module.image_offset
    sent = np.frombuffer(module.raw_buffer, np.uint8, size, module.image_offset)
    return DeliveredFrame(
        sent.copy(),
        module.width,
        module.height,
        module.frame_id,
        device_ts_ns,
        module.padding_x,
        module.is_complete(),
    )


def _converting_errors(serial: str) -> AbstractContextManager[None]:
    from genicam import genapi, gentl

    refusals = (
        genapi.AccessException,
        genapi.InvalidArgumentException,
        genapi.LogicalErrorException,
        genapi.OutOfRangeException,
    )
    losses = (genapi.GenericException, gentl.GenericException)
    return in_sentences(serial, refusals, losses)


def _quietly(act: Callable[[], object]) -> None:
    """Suppress errors of a camera that may be lost."""
    from genicam import genapi, gentl

    with suppress(genapi.GenericException, gentl.GenericException):
        act()


def _harvester(producer: str) -> Any:
    """Return a harvester with the given producer, or with all of the system.

    Raises `DeviceNotFound` if there is no producer, or none of them loads.
    """
    try:
        from harvesters.core import Harvester
    except ImportError as error:  # without the shared library of Python
        raise DeviceNotFound(_ABSENT) from error

    files = [Path(producer)] if producer else _producers()
    if not files:
        raise DeviceNotFound("genicam.no-producer", variable=PRODUCERS, suffix=SUFFIX)
    refusals = [_refusal(file) for file in files]
    harvester = Harvester()
    for file, refusal in zip(files, refusals, strict=True):
        if refusal is None:
            harvester.add_file(str(file))
    if not harvester.files:
        raise DeviceNotFound(
            "genicam.does-not-load", file=files[0], why=refusals[0] or ""
        )
    harvester.update()
    return harvester


def _refusal(producer: Path) -> str | None:
    """Return why a producer does not load; None if it does."""
    from genicam import gentl

    library = gentl.GenTLProducer.create_producer()
    try:
        library.open(str(producer))
    except gentl.GenericException as error:
        return str(error)
    library.close()
    return None


def _producers() -> list[Path]:
    """Return the producers registered in the system."""
    folders = [Path(each) for each in os.environ.get(PRODUCERS, "").split(os.pathsep)]
    return sorted(
        file for folder in folders if folder.name for file in folder.glob(f"*{SUFFIX}")
    )


def _find(producer: str) -> tuple[FoundDevice, ...]:
    harvester = _harvester(producer)
    found = tuple(
        FoundDevice(
            info.serial_number or info.id_,
            f"{info.vendor} {info.model} ({info.serial_number or info.id_})",
        )
        for info in harvester.device_info_list
    )
    _quietly(harvester.reset)
    return found


_ABSENT = message("genicam.absent", python=sys.executable)


def _is_installed() -> bool:
    return bool(find_spec("harvesters") and find_spec("genicam"))


def _why_absent() -> Message | None:
    return None if _is_installed() else _ABSENT


def _camera(place: SourcePlace, clock: Clock) -> DeviceCamera:
    return DeviceCamera(GenicamDevice(place), clock)


GENICAM = Source(
    "genicam",
    message("source.genicam"),
    SourceNeeds.DEVICE_AND_PRODUCER,
    _camera,
    _find,
    _why_absent,
)
