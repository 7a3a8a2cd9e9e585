"""A GigE Vision camera on this machine's loopback, as Aravis simulates it.

Real packets, images of one's own. Run as a program it serves Aravis' test pattern until
it is killed.
"""

import ctypes
import sys
from collections.abc import Callable
from ctypes import POINTER, c_char_p, c_double, c_size_t, c_uint32, c_void_p
from threading import Event
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

# Never a broadcast: cameras of the network are not ours to ask.
ADDRESS, SECOND_ADDRESS = "127.0.0.1", "127.0.0.2"
SENSOR_HEIGHT, SENSOR_WIDTH = 0x118, 0x11C  # registers of Aravis' simulated camera
Scene: TypeAlias = Callable[[float, int], npt.NDArray[np.generic]]
_Fill = ctypes.CFUNCTYPE(None, c_void_p, c_void_p, c_uint32, c_uint32, c_uint32)


class GigeSimulator:
    """A simulated camera that is there until it is unplugged."""

    def __init__(self, serial: str = "LP01", address: str = ADDRESS) -> None:
        self._library = library = ctypes.CDLL("libaravis-0.8.so.0")
        self._gobject = ctypes.CDLL("libgobject-2.0.so.0")
        self._gobject.g_object_unref.argtypes = [c_void_p]
        library.arv_gv_fake_camera_new_full.restype = c_void_p
        library.arv_gv_fake_camera_new_full.argtypes = [c_char_p] * 3
        library.arv_gv_fake_camera_is_running.argtypes = [c_void_p]
        library.arv_gv_fake_camera_get_fake_camera.restype = c_void_p
        library.arv_gv_fake_camera_get_fake_camera.argtypes = [c_void_p]
        library.arv_fake_camera_set_fill_pattern.argtypes = [
            *(c_void_p, _Fill, c_void_p, c_void_p)
        ]
        library.arv_fake_camera_write_register.argtypes = [c_void_p, c_uint32, c_uint32]
        library.arv_fake_camera_get_payload.restype = c_size_t
        library.arv_fake_camera_get_payload.argtypes = [c_void_p]
        library.arv_buffer_get_data.restype = c_void_p
        library.arv_buffer_get_data.argtypes = [c_void_p, POINTER(c_size_t)]
        self._fill = _Fill(self._on_fill)  # the library calls it as long as it runs
        self._scene: Scene | None = None
        self._serial, self._address = serial, address
        self._simulator: int | None = None
        self.plug_in()

    def plug_in(self) -> None:
        """Be there."""
        library = self._library
        self._simulator = library.arv_gv_fake_camera_new_full(
            self._address.encode(), self._serial.encode(), None
        )
        if not library.arv_gv_fake_camera_is_running(self._simulator):
            raise RuntimeError(f"Port 3956 of {self._address} is taken.")
        self.serve(self._scene)

    def unplug(self) -> None:
        """Be there no more."""
        simulator, self._simulator = self._simulator, None
        if simulator is not None:
            self._gobject.g_object_unref(simulator)

    def widen(self, width: int, height: int) -> None:
        """Have a sensor of another size than the usual 2048 x 2048."""
        library = self._library
        fake = library.arv_gv_fake_camera_get_fake_camera(self._simulator)
        library.arv_fake_camera_write_register(fake, SENSOR_WIDTH, width)
        library.arv_fake_camera_write_register(fake, SENSOR_HEIGHT, height)

    def lose_packets(self, share: float) -> None:
        """Leave out so many of the packets of images, 0 to 1."""
        lost = c_double(share)
        self._gobject.g_object_set(
            c_void_p(self._simulator), b"gvsp-lost-ratio", lost, None
        )

    def serve(self, scene: Scene | None) -> None:
        """Show images by exposure, us, and gain; None for the test pattern."""
        self._scene = scene
        if scene is not None:
            library = self._library
            fake = library.arv_gv_fake_camera_get_fake_camera(self._simulator)
            library.arv_fake_camera_set_fill_pattern(fake, self._fill, None, None)

    def _on_fill(
        self, buffer: int, _: int, exposure_us: int, gain: int, pixel_format: int
    ) -> None:
        if self._simulator is None:  # it is being unplugged
            return
        assert self._scene is not None
        image = np.ascontiguousarray(self._scene(exposure_us, gain))
        library = self._library
        fake = library.arv_gv_fake_camera_get_fake_camera(self._simulator)
        size = library.arv_fake_camera_get_payload(fake)
        data = library.arv_buffer_get_data(buffer, None)
        ctypes.memmove(data, image.ctypes.data, min(image.nbytes, size))


if __name__ == "__main__":
    simulator = GigeSimulator(*sys.argv[1:])
    sys.stdout.write("there\n")
    sys.stdout.flush()
    Event().wait()
