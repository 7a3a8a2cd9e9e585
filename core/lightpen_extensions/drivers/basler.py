"""Basler cameras by pypylon, which includes pylon."""

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, suppress
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from lightpen.cameras.pairing import Clock
from lightpen.cameras.protocol import DeviceNotFound, busy, lost, not_found
from lightpen.cameras.source import FoundDevice, Source, SourceNeeds, SourcePlace
from lightpen.messages import Message, message
from lightpen_extensions.drivers.device_camera import (
    DeliveredFrame,
    DeviceCamera,
    in_sentences,
)
from lightpen_extensions.drivers.genicam import GenapiDevice, GenapiFeatures, refusals

NAME = "Basler (pylon)"
# Kinds of connection, those first that are searched without asking the network.
LAYERS = ("BaslerCamEmu", "BaslerUsb", "BaslerGigE", "BaslerCxp")
N_BUFFERS = 16  # images in transit; each buffer is returned once copied


class BaslerDevice(GenapiDevice):
    """A camera that pylon drives, found by its serial number."""

    def __init__(self, serial: str) -> None:
        self.serial = serial
        self._camera: Any = None

    def open(self) -> None:
        """Open the camera."""
        if (why_absent := _why_absent()) is not None:
            raise DeviceNotFound(why_absent)
        from pypylon import genicam, pylon

        try:
            layer, info = next(
                (layer, info)
                for layer, info in _infos()
                if info.GetSerialNumber() == self.serial
            )
        except StopIteration:
            raise not_found(self.serial) from None
        if not layer.IsDeviceAccessible(info):
            raise busy(self.serial)
        try:
            self._camera = camera = pylon.InstantCamera(layer.CreateDevice(info))
            camera.Open()
        except genicam.GenericException as error:
            self.close()
            raise not_found(self.serial, str(error)) from error
        camera.MaxNumBuffer.Value = N_BUFFERS
        nodes = camera.GetNodeMap()
        self._features = GenapiFeatures(
            nodes.GetNode,
            str.capitalize,
            lambda node: node.GetAccessMode(),
            partial(_converting_errors, self.serial),
        )

    def close(self) -> None:
        """Close the camera."""
        self._features = None
        camera, self._camera = self._camera, None
        if camera is not None:
            from pypylon import genicam

            with suppress(genicam.GenericException):
                camera.Close()
            with suppress(genicam.GenericException):
                camera.DestroyDevice()

    def start(self) -> None:
        """Start streaming."""
        from pypylon import pylon

        with _converting_errors(self.serial):
            self._camera.StartGrabbing(pylon.GrabStrategy_OneByOne)

    def stop(self) -> None:
        """Stop streaming."""
        from pypylon import genicam

        with suppress(genicam.GenericException):
            self._camera.StopGrabbing()

    def fetch(self, timeout_s: float) -> DeliveredFrame | None:
        """Return the next image; None after the timeout."""
        from pypylon import pylon

        timeout_ms, returns = round(1000 * timeout_s), pylon.TimeoutHandling_Return
        with _converting_errors(self.serial):
            result = self._camera.RetrieveResult(timeout_ms, returns)
            if not result.IsValid():
                return None
            with result:
                return _delivery(result)

    def probe(self) -> None:
        """Raise an error unless the camera responds."""
        if self._camera.IsCameraDeviceRemoved():
            raise lost(self.serial, "it was removed")
        self.features.number("Width")


def _delivery(result: Any) -> DeliveredFrame:
    if not result.GrabSucceeded():
        nothing = np.zeros(0, np.uint8)
        return DeliveredFrame(nothing, 0, 0, result.GetBlockID(), is_complete=False)
    return DeliveredFrame(
        np.frombuffer(result.GetBuffer(), np.uint8),
        result.GetWidth(),
        result.GetHeight(),
        result.GetBlockID(),
        result.GetTimeStamp() or None,
        result.GetPaddingX(),
    )


def _converting_errors(serial: str) -> AbstractContextManager[None]:
    from pypylon import genicam

    return in_sentences(serial, refusals(genicam), (genicam.GenericException,))


def _infos() -> Iterator[tuple[Any, Any]]:
    """Yield every camera with its transport layer."""
    from pypylon import pylon

    factory = pylon.TlFactory.GetInstance()
    known = {layer.GetDeviceClass() for layer in factory.EnumerateTls()}
    for name in LAYERS:
        if name in known:
            layer = factory.CreateTl(name)
            if layer is not None:  # None: a system component is missing
                yield from ((layer, info) for info in layer.EnumerateDevices())


def _find(producer: str) -> tuple[FoundDevice, ...]:
    return tuple(
        FoundDevice(info.GetSerialNumber(), f"Basler {info.GetFriendlyName()}")
        for _, info in _infos()
    )


def _why_absent() -> Message | None:
    if find_spec("pypylon") is not None:
        return None
    if find_spec("pip") is None:  # as in the program that the Windows installer brings
        return message("basler.not-part")
    return message("basler.absent", python=sys.executable)


def _camera(place: SourcePlace, clock: Clock) -> DeviceCamera:
    return DeviceCamera(BaslerDevice(place.name), clock)


BASLER = Source(
    "basler",
    message("source.named", name=NAME),
    SourceNeeds.DEVICE,
    _camera,
    _find,
    _why_absent,
)
