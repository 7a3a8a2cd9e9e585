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
from typing import Any

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


class Aravis:
    """The functions of the library, named without ``arv_``.

    Those of a camera take its pointer first; what fails raises `AravisError`.
    """

    def __init__(self) -> None:
        self._library = ctypes.CDLL(NAME)
        self._glib = ctypes.CDLL(GLIB)
        self._gobject = ctypes.CDLL(GOBJECT)
        plain, risky = self._plain, self._risky
        pointer, text = c_void_p, c_char_p

        self.update_device_list = plain("update_device_list", None)
        self.get_n_devices = plain("get_n_devices", c_uint)
        self.get_device_id = plain("get_device_id", text, c_uint)
        self.get_device_serial_nbr = plain("get_device_serial_nbr", text, c_uint)
        self.get_device_model = plain("get_device_model", text, c_uint)
        self.get_device_vendor = plain("get_device_vendor", text, c_uint)

        self.camera_new = risky("camera_new", pointer, text)
        self.camera_get_device = plain("camera_get_device", pointer, pointer)
        self.camera_is_gv_device = plain("camera_is_gv_device", c_bool, pointer)
        self.gv_device_is_controller = plain("gv_device_is_controller", c_bool, pointer)
        self.camera_gv_set_stream_options = plain(
            "camera_gv_set_stream_options", None, pointer, c_int
        )
        self.camera_get_device_serial_number = risky(
            "camera_get_device_serial_number", text, pointer
        )
        self.camera_get_payload = risky("camera_get_payload", c_uint, pointer)
        self.camera_start_acquisition = risky("camera_start_acquisition", None, pointer)
        self.camera_stop_acquisition = risky("camera_stop_acquisition", None, pointer)
        self.camera_create_stream = risky(
            "camera_create_stream", pointer, pointer, pointer, pointer
        )

        self.device_get_feature = plain("device_get_feature", pointer, pointer, text)
        self.gc_integer_get_type = plain("gc_integer_get_type", c_size_t)
        self.camera_is_feature_available = risky(
            "camera_is_feature_available", c_bool, pointer, text
        )
        self.camera_get_integer = risky("camera_get_integer", c_int64, pointer, text)
        self.camera_set_integer = risky(
            "camera_set_integer", None, pointer, text, c_int64
        )
        self.camera_get_integer_bounds = risky(
            "camera_get_integer_bounds",
            None,
            pointer,
            text,
            POINTER(c_int64),
            POINTER(c_int64),
        )
        self.camera_get_integer_increment = risky(
            "camera_get_integer_increment", c_int64, pointer, text
        )
        self.camera_get_float = risky("camera_get_float", c_double, pointer, text)
        self.camera_set_float = risky("camera_set_float", None, pointer, text, c_double)
        self.camera_get_float_bounds = risky(
            "camera_get_float_bounds",
            None,
            pointer,
            text,
            POINTER(c_double),
            POINTER(c_double),
        )
        self.camera_get_string = risky("camera_get_string", text, pointer, text)
        self.camera_set_string = risky("camera_set_string", None, pointer, text, text)
        self.camera_set_boolean = risky(
            "camera_set_boolean", None, pointer, text, c_int
        )
        self.camera_execute_command = risky(
            "camera_execute_command", None, pointer, text
        )
        self.camera_dup_available_enumerations_as_strings = risky(
            "camera_dup_available_enumerations_as_strings",
            POINTER(text),
            pointer,
            text,
            POINTER(c_uint),
        )

        self.stream_get_info_uint64_by_name = plain(
            "stream_get_info_uint64_by_name", c_uint64, pointer, text
        )
        self.stream_push_buffer = plain("stream_push_buffer", None, pointer, pointer)
        self.stream_timeout_pop_buffer = plain(
            "stream_timeout_pop_buffer", pointer, pointer, c_uint64
        )
        self.buffer_new_allocate = plain("buffer_new_allocate", pointer, c_size_t)
        self.buffer_get_status = plain("buffer_get_status", c_int, pointer)
        self.buffer_get_frame_id = plain("buffer_get_frame_id", c_uint64, pointer)
        self.buffer_get_timestamp = plain("buffer_get_timestamp", c_uint64, pointer)
        self.buffer_get_image_data = plain(
            "buffer_get_image_data", pointer, pointer, POINTER(c_size_t)
        )
        self.buffer_get_image_width = plain("buffer_get_image_width", c_int, pointer)
        self.buffer_get_image_height = plain("buffer_get_image_height", c_int, pointer)
        self.buffer_get_image_padding = plain(
            "buffer_get_image_padding", None, pointer, POINTER(c_int), POINTER(c_int)
        )

        self._device_errors = plain("device_error_quark", c_uint32)()
        self._free_error = _bound(self._glib.g_error_free, None, POINTER(_GError))
        self.free = _bound(self._glib.g_free, None, pointer)
        self.unref = _bound(self._gobject.g_object_unref, None, pointer)
        # One property, its value, and the null that ends the list of them.
        self.set_property = _bound(
            self._gobject.g_object_set, None, pointer, text, c_int, pointer
        )
        self.is_a = _bound(
            self._gobject.g_type_check_instance_is_a, c_bool, pointer, c_size_t
        )

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
