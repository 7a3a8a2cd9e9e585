"""Basler cameras through pypylon, which brings the whole of pylon with it."""

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, suppress
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from lightpen.cameras.clock import Clock
from lightpen.cameras.device_camera import Delivery, DeviceCamera
from lightpen.cameras.device_errors import busy, in_sentences, lost, not_found
from lightpen.cameras.genapi_features import GenapiFeatures, refusals
from lightpen.cameras.protocol import DeviceNotFound
from lightpen.cameras.source import FoundDevice, Needs, Source, SourcePlace
from lightpen.sentences import Sentence, sentence

# Kinds of connection, those first that are searched without asking the network.
LAYERS = ("BaslerCamEmu", "BaslerUsb", "BaslerGigE", "BaslerCxp")
N_BUFFERS = 16  # images on their way; each is given back as soon as it is copied


class BaslerDevice:
    """A camera that pylon drives, found by its serial number."""

    def __init__(self, serial: str) -> None:
        self._serial = serial
        self._camera: Any = None
        self._features: GenapiFeatures | None = None

    @property
    def serial(self) -> str:
        """Serial number."""
        return self._serial

    @property
    def features(self) -> GenapiFeatures:
        """The features of the open camera."""
        assert self._features is not None
        return self._features

    def open(self) -> None:
        """Take hold of the camera."""
        if (why_absent := _why_absent()) is not None:
            raise DeviceNotFound(why_absent)
        from pypylon import genicam, pylon

        try:
            layer, info = next(
                (layer, info)
                for layer, info in _infos()
                if info.GetSerialNumber() == self._serial
            )
        except StopIteration:
            raise not_found(self._serial) from None
        if not layer.IsDeviceAccessible(info):
            raise busy(self._serial)
        try:
            self._camera = camera = pylon.InstantCamera(layer.CreateDevice(info))
            camera.Open()
        except genicam.GenericException as error:
            self.close()
            raise not_found(self._serial, str(error)) from error
        camera.MaxNumBuffer.Value = N_BUFFERS
        nodes = camera.GetNodeMap()
        self._features = GenapiFeatures(
            nodes.GetNode,
            str.capitalize,
            lambda node: node.GetAccessMode(),
            partial(_told, self._serial),
        )

    def close(self) -> None:
        """Let go of the camera."""
        self._features = None
        camera, self._camera = self._camera, None
        if camera is not None:
            from pypylon import genicam

            with suppress(genicam.GenericException):
                camera.Close()
            with suppress(genicam.GenericException):
                camera.DestroyDevice()

    def start(self) -> None:
        """Let images come."""
        from pypylon import pylon

        with _told(self._serial):
            self._camera.StartGrabbing(pylon.GrabStrategy_OneByOne)

    def stop(self) -> None:
        """Let no more images come."""
        from pypylon import genicam

        with suppress(genicam.GenericException):
            self._camera.StopGrabbing()

    def fetch(self, timeout_s: float) -> Delivery | None:
        """Return the next image, None where none comes in time."""
        from pypylon import pylon

        timeout_ms, returns = round(1000 * timeout_s), pylon.TimeoutHandling_Return
        with _told(self._serial):
            result = self._camera.RetrieveResult(timeout_ms, returns)
            if not result.IsValid():
                return None
            with result:
                return _delivery(result)

    def probe(self) -> None:
        """Do nothing if the camera answers."""
        if self._camera.IsCameraDeviceRemoved():
            raise lost(self._serial, "it was removed")
        self.features.number("Width")


def _delivery(result: Any) -> Delivery:
    if not result.GrabSucceeded():
        nothing = np.zeros(0, np.uint8)
        return Delivery(nothing, 0, 0, result.GetBlockID(), is_complete=False)
    return Delivery(
        np.frombuffer(result.GetBuffer(), np.uint8),
        result.GetWidth(),
        result.GetHeight(),
        result.GetBlockID(),
        result.GetTimeStamp() or None,
        result.GetPaddingX(),
    )


def _told(serial: str) -> AbstractContextManager[None]:
    from pypylon import genicam

    return in_sentences(serial, refusals(genicam), (genicam.GenericException,))


def _infos() -> Iterator[tuple[Any, Any]]:
    """Return every camera with the layer that it is reached by."""
    from pypylon import pylon

    factory = pylon.TlFactory.GetInstance()
    known = {layer.GetDeviceClass() for layer in factory.EnumerateTls()}
    for name in LAYERS:
        if name in known:
            layer = factory.CreateTl(name)
            if layer is not None:  # what it needs of the system is not there
                yield from ((layer, info) for info in layer.EnumerateDevices())


def _find(producer: str) -> tuple[FoundDevice, ...]:
    return tuple(
        FoundDevice(info.GetSerialNumber(), f"Basler {info.GetFriendlyName()}")
        for _, info in _infos()
    )


def _why_absent() -> Sentence | None:
    if find_spec("pypylon") is not None:
        return None
    if find_spec("pip") is None:  # as in the program that the Windows installer brings
        return sentence(
            "basler.not-part",
            "pypylon is not part of this program. Basler cameras also work as GenICam "
            "cameras, with the GenTL producer of pylon.",
        )
    return sentence(
        "basler.absent",
        "pypylon is not installed. It drives Basler cameras: {python} -m pip install "
        "pypylon",
        python=sys.executable,
    )


def _camera(place: SourcePlace, clock: Clock) -> DeviceCamera:
    return DeviceCamera(BaslerDevice(place.name), clock)


BASLER = Source(
    "basler",
    sentence("source.basler", "Basler (pylon)"),
    Needs.DEVICE,
    _camera,
    _find,
    _why_absent,
)
