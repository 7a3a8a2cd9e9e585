"""Images of a camera, as tests read them."""

from lightpen.cameras.protocol import Frame, FrameIncomplete, ImageCamera

TIMEOUT = 60.0  # s, far above the period of every source


def whole_image(camera: ImageCamera, timeout_s: float = TIMEOUT) -> Frame:
    """Read on until an image is whole.

    Where packets of others keep Aravis from a packet socket, its receive buffer grows
    only with the first packet, and the first image may lose some.
    """
    while True:
        try:
            return camera.read(timeout_s)
        except FrameIncomplete:
            assert camera.stats().incomplete < 5
