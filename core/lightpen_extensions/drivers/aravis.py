"""GigE Vision and USB3 Vision cameras through Aravis, without a vendor's software."""

import ctypes
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from ctypes import (
    POINTER,
    byref,
    c_bool,
    c_char_p,
    c_double,
    c_int,
    c_int64,
    c_size_t,
    c_uint,
    c_uint32,
    c_uint64,
    c_void_p,
)
from functools import cache
from ipaddress import ip_address
from time import sleep
from typing import TYPE_CHECKING, Any

import numpy as np

from lightpen.cameras.pairing import Clock
from lightpen.cameras.protocol import DeviceNotFound, Range, busy, lost, not_found
from lightpen.cameras.source import FoundDevice, Source, SourceNeeds, SourcePlace
from lightpen.messages import Message, message
from lightpen_extensions.drivers.device_camera import (
    DeliveredFrame,
    DeviceCamera,
    setting_refused,
)

# Bindings of Aravis by ctypes, with errors as exceptions.
#
# Aravis drives GigE Vision and USB3 Vision cameras without a vendor's software. Its
# Python binding needs PyGObject, which no wheel brings; these few functions need
# nothing.


NAME = "libaravis-0.8.so.0"
GLIB, GOBJECT = "libglib-2.0.so.0", "libgobject-2.0.so.0"
SUCCESS = 0  # of ArvBufferStatus
ANY_SOCKET, NO_PACKET_SOCKET = 0, 1  # of ArvGvStreamOption
GONE = {2, 3, 4, 5, 10}  # of ArvDeviceError: lost, broken, timed out, not controlled


class AravisError(Exception):
    """A call failed; `is_gone` if the camera no longer answers or obeys."""

    def __init__(self, message: str, is_gone: bool) -> None:
        super().__init__(message)
        self.is_gone = is_gone


class _GError(ctypes.Structure):
    _fields_ = (("domain", c_uint32), ("code", c_int), ("message", c_char_p))


ADDRESS, TEXT = c_void_p, c_char_p
INTEGER, NUMBER = POINTER(c_int64), POINTER(c_double)  # that are filled in
# Result and arguments of the functions that cannot fail, named without ``arv_``;
PLAIN: dict[str, tuple[Any, ...]] = {
    "update_device_list": (None,),
    "get_n_devices": (c_uint,),
    "get_device_id": (TEXT, c_uint),
    "get_device_serial_nbr": (TEXT, c_uint),
    "get_device_model": (TEXT, c_uint),
    "get_device_vendor": (TEXT, c_uint),
    "camera_get_device": (ADDRESS, ADDRESS),
    "camera_is_gv_device": (c_bool, ADDRESS),
    "gv_device_is_controller": (c_bool, ADDRESS),
    "camera_gv_set_stream_options": (None, ADDRESS, c_int),
    "device_get_feature": (ADDRESS, ADDRESS, TEXT),
    "gc_integer_get_type": (c_size_t,),
    "stream_get_info_uint64_by_name": (c_uint64, ADDRESS, TEXT),
    "stream_push_buffer": (None, ADDRESS, ADDRESS),
    "stream_timeout_pop_buffer": (ADDRESS, ADDRESS, c_uint64),
    "buffer_new_allocate": (ADDRESS, c_size_t),
    "buffer_get_status": (c_int, ADDRESS),
    "buffer_get_frame_id": (c_uint64, ADDRESS),
    "buffer_get_timestamp": (c_uint64, ADDRESS),
    "buffer_get_image_data": (ADDRESS, ADDRESS, POINTER(c_size_t)),
    "buffer_get_image_width": (c_int, ADDRESS),
    "buffer_get_image_height": (c_int, ADDRESS),
    "buffer_get_image_padding": (None, ADDRESS, POINTER(c_int), POINTER(c_int)),
}
# and of those that report errors by one argument more.
RISKY: dict[str, tuple[Any, ...]] = {
    "camera_new": (ADDRESS, TEXT),
    "camera_get_device_serial_number": (TEXT, ADDRESS),
    "camera_get_payload": (c_uint, ADDRESS),
    "camera_start_acquisition": (None, ADDRESS),
    "camera_stop_acquisition": (None, ADDRESS),
    "camera_create_stream": (ADDRESS, ADDRESS, ADDRESS, ADDRESS),
    "camera_is_feature_available": (c_bool, ADDRESS, TEXT),
    "camera_get_integer": (c_int64, ADDRESS, TEXT),
    "camera_set_integer": (None, ADDRESS, TEXT, c_int64),
    "camera_get_integer_bounds": (None, ADDRESS, TEXT, INTEGER, INTEGER),
    "camera_get_integer_increment": (c_int64, ADDRESS, TEXT),
    "camera_get_float": (c_double, ADDRESS, TEXT),
    "camera_set_float": (None, ADDRESS, TEXT, c_double),
    "camera_get_float_bounds": (None, ADDRESS, TEXT, NUMBER, NUMBER),
    "camera_get_string": (TEXT, ADDRESS, TEXT),
    "camera_set_string": (None, ADDRESS, TEXT, TEXT),
    "camera_set_boolean": (None, ADDRESS, TEXT, c_int),
    "camera_execute_command": (None, ADDRESS, TEXT),
    "camera_dup_available_enumerations_as_strings": (
        POINTER(TEXT),
        ADDRESS,
        TEXT,
        POINTER(c_uint),
    ),
}


class Aravis:
    """The functions of `PLAIN` and `RISKY`, and some of GLib.

    Those of a camera take its pointer first; what fails raises `AravisError`.
    """

    def __init__(self) -> None:
        self._library = ctypes.CDLL(NAME)
        glib, gobject = ctypes.CDLL(GLIB), ctypes.CDLL(GOBJECT)
        for name, signature in PLAIN.items():
            setattr(self, name, self._plain(name, *signature))
        for name, signature in RISKY.items():
            setattr(self, name, self._risky(name, *signature))
        self._device_errors = self._plain("device_error_quark", c_uint32)()
        self._free_error = _bound(glib.g_error_free, None, POINTER(_GError))
        self.free = _bound(glib.g_free, None, ADDRESS)
        self.unref = _bound(gobject.g_object_unref, None, ADDRESS)
        # One property, its value, and the null that ends the list of them.
        self.set_property = _bound(
            gobject.g_object_set, None, ADDRESS, TEXT, c_int, ADDRESS
        )
        self.is_a = _bound(
            gobject.g_type_check_instance_is_a, c_bool, ADDRESS, c_size_t
        )

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Callable[..., Any]: ...

    def _plain(self, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
        return _bound(getattr(self._library, f"arv_{name}"), result, *arguments)

    def _risky(self, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
        """Return a function that reports errors by its last argument."""
        call = self._plain(name, result, *arguments, POINTER(POINTER(_GError)))

        def checked(*values: Any) -> Any:
            error = POINTER(_GError)()
            found = call(*values, byref(error))
            if error:
                content = error.contents
                message = content.message.decode("utf-8", "replace")
                is_of_device = content.domain == self._device_errors
                is_gone = is_of_device and content.code in GONE
                self._free_error(error)
                raise AravisError(message, is_gone)
            return found

        return checked


def _bound(function: Any, result: Any, *arguments: Any) -> Callable[..., Any]:
    function.restype = result
    function.argtypes = arguments
    bound: Callable[..., Any] = function
    return bound


@cache
def load_aravis() -> Aravis:
    """Return the library; raise `OSError` or, if too old, `AttributeError`."""
    return Aravis()


N_BUFFERS = 16  # images in transit; each buffer is returned once copied
WAITING = 1 << 24  # receive buffer, bytes; less where the system limits it

# Where this program may open packet sockets, which lose least on a loaded machine,
# Aravis 0.8 opens one for each stream and lets in whatever packets pass this machine
# until it has set the filter of its camera. It takes them for images, and throws away
# the camera's own as late where their numbers are lower.
RECEIVED = b"n_received_packets"
TRIES = 3  # after which the stream does without one
STRAYING_S = 0.03  # several times the delay of a packet in its socket


class AravisFeatures:
    """The features of an open camera, with what raises errors as messages."""

    def __init__(
        self,
        aravis: Aravis,
        camera: int,
        converting_errors: Callable[[], AbstractContextManager[None]],
    ) -> None:
        self._aravis = aravis
        self._camera = camera
        self._converting_errors = converting_errors
        self._device = aravis.camera_get_device(camera)

    def has(self, name: str) -> bool:
        """Return whether the camera has a feature that is available now."""
        found: bool = self._call(
            self._aravis.camera_is_feature_available, name.encode()
        )
        return found

    def number(self, name: str) -> float:
        """Return the value of a number."""
        aravis = self._aravis
        is_integer = self._is_integer(name)
        get = aravis.camera_get_integer if is_integer else aravis.camera_get_float
        return float(self._call(get, name.encode()))

    def limits(self, name: str) -> Range:
        """Return the present range of a number."""
        aravis, key = self._aravis, name.encode()
        if self._is_integer(name):
            least, most = c_int64(), c_int64()
            self._call(aravis.camera_get_integer_bounds, key, byref(least), byref(most))
            step = float(self._call(aravis.camera_get_integer_increment, key))
            return Range(float(least.value), float(most.value), step)
        low, high = c_double(), c_double()
        self._call(aravis.camera_get_float_bounds, key, byref(low), byref(high))
        return Range(low.value, high.value)

    def choice(self, name: str) -> str:
        """Return the current entry of an enumeration."""
        entry: bytes = self._call(self._aravis.camera_get_string, name.encode())
        return entry.decode()

    def choices(self, name: str) -> tuple[str, ...]:
        """Return the entries of an enumeration that can be chosen now."""
        aravis, n_entries = self._aravis, c_uint()
        entries = self._call(
            aravis.camera_dup_available_enumerations_as_strings,
            name.encode(),
            byref(n_entries),
        )
        found = tuple(entries[i].decode() for i in range(n_entries.value))
        aravis.free(entries)
        return found

    def set(self, name: str, value: float | str | bool) -> None:
        """Set a number within its limits, an entry of an enumeration or a switch."""
        aravis, key = self._aravis, name.encode()
        if isinstance(value, str):
            self._call(aravis.camera_set_string, key, value.encode())
        elif isinstance(value, bool):
            self._call(aravis.camera_set_boolean, key, value)
        elif self._is_integer(name):
            self._call(aravis.camera_set_integer, key, round(value))
        else:
            self._call(aravis.camera_set_float, key, float(value))

    def execute(self, name: str) -> None:
        """Execute a command."""
        self._call(self._aravis.camera_execute_command, name.encode())

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        with self._converting_errors():
            return function(self._camera, *arguments)

    def _is_integer(self, name: str) -> bool:
        node = self._aravis.device_get_feature(self._device, name.encode())
        found: bool = self._aravis.is_a(node, self._aravis.gc_integer_get_type())
        return found


class AravisDevice:
    """A camera that Aravis drives, by its serial number or address.

    With an address it is opened without a search, also if the network blocks
    broadcasts.
    """

    def __init__(self, place: str) -> None:
        self._place = place
        self.serial = place  # until it is open
        self._aravis: Aravis | None = None
        self._camera: int | None = None
        self._stream: int | None = None
        self._features: AravisFeatures | None = None
        self._is_gone = False

    @property
    def features(self) -> AravisFeatures:
        """The features of the open camera."""
        assert self._features is not None
        return self._features

    def open(self) -> None:
        """Open the camera."""
        self._is_gone = False
        try:
            self._aravis = aravis = load_aravis()
        except OSError as error:
            raise DeviceNotFound(_ABSENT) from error
        name = self._place if _is_address(self._place) else self._searched(aravis)
        try:
            self._camera = camera = aravis.camera_new(name.encode())
        except AravisError as error:
            raise not_found(self._place, str(error)) from error
        self._require_control(aravis, camera)
        with suppress(AravisError):  # not every camera shows its serial number
            serial = aravis.camera_get_device_serial_number(camera)
            self.serial = serial.decode("utf-8", "replace") or self.serial
        self._features = AravisFeatures(aravis, camera, self._converting_errors)

    def close(self) -> None:
        """Close the camera."""
        self._drop_stream()
        camera, self._camera = self._camera, None
        self._features = None
        if self._aravis is not None and camera is not None:
            self._aravis.unref(camera)

    def start(self) -> None:
        """Start streaming."""
        aravis, camera = self._open_ones()
        with self._converting_errors():
            payload = aravis.camera_get_payload(camera)
            if aravis.camera_is_gv_device(camera):
                self._stream = stream = self._gige_stream(aravis, camera)
                aravis.set_property(stream, b"socket-buffer-size", WAITING, None)
            else:
                stream = aravis.camera_create_stream(camera, None, None)
                self._stream = stream
            for _ in range(N_BUFFERS):
                aravis.stream_push_buffer(stream, aravis.buffer_new_allocate(payload))
            aravis.camera_start_acquisition(camera)

    def stop(self) -> None:
        """Stop streaming."""
        aravis, camera = self._open_ones()
        if not self._is_gone:  # seconds would pass without an answer
            with suppress(AravisError):
                aravis.camera_stop_acquisition(camera)
        self._drop_stream()

    def fetch(self, timeout_s: float) -> DeliveredFrame | None:
        """Return the next image; None after the timeout."""
        aravis, stream = self._aravis, self._stream
        assert aravis is not None
        buffer = aravis.stream_timeout_pop_buffer(stream, round(timeout_s * 1e6))
        if buffer is None:
            return None
        try:
            return _delivery(aravis, buffer)
        finally:
            aravis.stream_push_buffer(stream, buffer)

    def probe(self) -> None:
        """Raise an error unless the camera responds."""
        aravis, camera = self._open_ones()
        with self._converting_errors():
            aravis.camera_get_integer(camera, b"Width")
        self._require_control(aravis, camera, is_new=False)

    @contextmanager
    def _converting_errors(self) -> Iterator[None]:
        """Convert the errors of the library."""
        try:
            yield
        except AravisError as error:
            if not error.is_gone:
                raise setting_refused(self.serial, str(error)) from error
            self._is_gone = True
            raise lost(self.serial, str(error)) from error

    def _open_ones(self) -> tuple[Aravis, int]:
        assert self._aravis is not None
        assert self._camera is not None
        return self._aravis, self._camera

    def _drop_stream(self) -> None:
        stream, self._stream = self._stream, None
        if self._aravis is not None and stream is not None:
            self._aravis.unref(stream)

    def _gige_stream(self, aravis: Aravis, camera: int) -> int:
        """Return a stream that receives packets of this camera only."""
        with suppress(AravisError):  # a crashed program left it streaming
            aravis.camera_stop_acquisition(camera)
        aravis.camera_gv_set_stream_options(camera, ANY_SOCKET)
        stream: int
        for _ in range(TRIES):
            stream = aravis.camera_create_stream(camera, None, None)
            sleep(STRAYING_S)
            if aravis.stream_get_info_uint64_by_name(stream, RECEIVED) == 0:
                return stream
            aravis.unref(stream)
        aravis.camera_gv_set_stream_options(camera, NO_PACKET_SOCKET)
        stream = aravis.camera_create_stream(camera, None, None)
        return stream

    def _searched(self, aravis: Aravis) -> str:
        """Return the device ID of the camera with this serial number."""
        for index in _listed(aravis):
            known = (aravis.get_device_serial_nbr(index), aravis.get_device_id(index))
            if self._place.encode() in known:
                name: bytes = known[1]
                return name.decode()
        raise not_found(self._place)

    def _require_control(
        self, aravis: Aravis, camera: int, *, is_new: bool = True
    ) -> None:
        """Raise `DeviceBusy` if another program controls the camera."""
        if not aravis.camera_is_gv_device(camera):
            return
        if aravis.gv_device_is_controller(aravis.camera_get_device(camera)):
            return
        if not is_new:
            raise lost(self.serial, "another program controls it")
        self.close()
        raise busy(self._place)


def _delivery(aravis: Aravis, buffer: int) -> DeliveredFrame:
    number = aravis.buffer_get_frame_id(buffer)
    if aravis.buffer_get_status(buffer) != SUCCESS:
        return DeliveredFrame(np.zeros(0, np.uint8), 0, 0, number, is_complete=False)
    size, x_padding, y_padding = c_size_t(), c_int(), c_int()
    data = aravis.buffer_get_image_data(buffer, byref(size))
    aravis.buffer_get_image_padding(buffer, byref(x_padding), byref(y_padding))
    sent = (ctypes.c_uint8 * size.value).from_address(data)
    return DeliveredFrame(
        np.ctypeslib.as_array(sent).copy(),
        aravis.buffer_get_image_width(buffer),
        aravis.buffer_get_image_height(buffer),
        number,
        aravis.buffer_get_timestamp(buffer),
        x_padding.value,
    )


def _is_address(place: str) -> bool:
    try:
        ip_address(place)
    except ValueError:
        return False
    return True


def _listed(aravis: Aravis) -> range:
    """Return the indices of all cameras that respond now."""
    aravis.update_device_list()
    return range(aravis.get_n_devices())


def _find(producer: str) -> tuple[FoundDevice, ...]:
    aravis = load_aravis()
    found = []
    for index in _listed(aravis):
        texts = (
            aravis.get_device_vendor(index),
            aravis.get_device_model(index),
            aravis.get_device_serial_nbr(index),
        )
        vendor, model, serial = ((t or b"").decode("utf-8", "replace") for t in texts)
        place = serial or aravis.get_device_id(index).decode("utf-8", "replace")
        found.append(FoundDevice(place, f"{vendor} {model} ({place})"))
    return tuple(found)


_ABSENT = message("aravis.absent")


def _why_absent() -> Message | None:
    try:
        load_aravis()
    except (OSError, AttributeError):
        return _ABSENT
    return None


def _camera(place: SourcePlace, clock: Clock) -> DeviceCamera:
    return DeviceCamera(AravisDevice(place.name), clock)


ARAVIS = Source(
    "aravis", message("source.aravis"), SourceNeeds.DEVICE, _camera, _find, _why_absent
)
