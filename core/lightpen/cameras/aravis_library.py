"""Bindings of Aravis by ctypes, with errors as exceptions.

Aravis drives GigE Vision and USB3 Vision cameras without a vendor's software. Its
Python binding needs PyGObject, which no wheel brings; these few functions need nothing.
"""

import ctypes
from collections.abc import Callable
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
from typing import TYPE_CHECKING, Any

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
