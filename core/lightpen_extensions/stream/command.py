"""``lightpen stream``: pose and tip by OpenIGTLink."""

import argparse
import sys
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event

from lightpen.cameras.pairing import MachineClock
from lightpen.cameras.protocol import (
    CameraSettings,
    EndOfImages,
    Failed,
    FaultRaised,
    FrameTimeout,
    ImageCamera,
    WorkerEvent,
)
from lightpen.cameras.replay import RECORDED, USUAL_FRAME_RATE, ReplayCamera
from lightpen.cameras.source import SourcePlace
from lightpen.cameras.sources import SOURCES, source_named
from lightpen.cameras.worker import CameraWorker
from lightpen.commands.arguments import (
    above_zero,
    add_camera,
    add_pen_options,
    whole_number,
)
from lightpen.commands.console import lacking, printing, shown
from lightpen.detection.pen_detection import PenDetection, detect_pen
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.errors import LightpenError, UsageError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.pen_files import read_pen
from lightpen.local_time import local_now
from lightpen.record.calibrations import read_calibration, with_status
from lightpen.record.swings.header import Names
from lightpen.record.swings.solving import FilesBeside, files_beside
from lightpen_extensions.measure.probing.current_tip import bending_of
from lightpen_extensions.measure.probing.sources import (
    instrument_of,
    touch_place,
    viewers_of_camera,
)
from lightpen_extensions.stream.messages import StreamedTip, tip_metadata
from lightpen_extensions.stream.server import (
    LOOPBACK,
    PORT,
    PoseStream,
    StreamPlace,
    StreamStatus,
)

LONGEST_WAIT = 0.5  # s for an image, before the keyboard is read


def add_stream(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen stream``."""
    parser.set_defaults(run=_stream)
    parser.add_argument(
        "place",
        metavar="PLACE",
        help="image folder, file name pattern, video or record of a swing; for a "
        "camera its serial number",
    )
    parser.add_argument(
        "--source",
        choices=[source.key for source in SOURCES if source.camera is not None],
        default=RECORDED.key,
        help=f"image source ({RECORDED.key})",
    )
    parser.add_argument(
        "--producer", default="", metavar="FILE", help="GenTL producer of a camera"
    )
    add_camera(parser, "intrinsics file of the camera")
    parser.add_argument("--pen", type=Path, metavar="FILE", help="LED file of the pen")
    add_pen_options(parser)
    parser.add_argument(
        "--tip",
        type=Path,
        metavar="RESULT.json",
        help="calibration of the tip; without it only the pose is streamed",
    )
    parser.add_argument(
        "--address",
        default=LOOPBACK,
        help="local network address to listen on; by default only programs on "
        f"this computer can connect ({LOOPBACK})",
    )
    parser.add_argument(
        "--port",
        type=whole_number,
        default=PORT,
        metavar="N",
        help=f"TCP port; 0 selects a free one ({PORT})",
    )
    parser.add_argument(
        "--rate",
        type=above_zero,
        default=USUAL_FRAME_RATE,
        metavar="HZ",
        help=f"frame rate of recorded images ({USUAL_FRAME_RATE:g})",
    )
    parser.add_argument(
        "--once",
        action="store_true",
        help="end after the last recorded image instead of repeating",
    )


@printing
def _stream(options: argparse.Namespace) -> None:
    listened = _listened(options)
    is_heard = Event()

    def note(status: StreamStatus) -> None:
        if status.n_clients:
            is_heard.set()
        if status.n_slow:
            print(f"Clients that miss poses: {status.n_slow}.", file=sys.stderr)

    stream = PoseStream(on_change=note)
    stream.set_tip(listened.tip)
    stream.open(StreamPlace(options.address, options.port))
    with closing(stream), suppress(KeyboardInterrupt):
        print(
            shown(f"The pen can be followed at {stream.status.place}."),
            "Ctrl+C ends it.",
            flush=True,
        )
        while not is_heard.wait(LONGEST_WAIT):  # recorded images wait for a client
            pass
        _play(listened, stream)


@dataclass(frozen=True, eq=False)
class _Listened:
    """The images to stream, with camera and pen."""

    images: ImageCamera
    region: RegionOfInterest
    tip: StreamedTip | None


def _listened(options: argparse.Namespace) -> _Listened:
    """Return the images to stream, with files as given or found beside them."""
    beside, mask = FilesBeside(), None
    source = source_named(options.source)
    if source is None or source.camera is None or source is RECORDED:
        beside, where = files_beside(options.place), touch_place((options.place,))
        mask = where.masks[0]
        images: ImageCamera = ReplayCamera(
            options.place,
            lambda: where.images[0],
            frame_rate=options.rate,
            loops=not options.once,
        )
    else:
        place = SourcePlace(options.place, options.producer)
        images = source.camera(place, MachineClock())
    camera_file, pen_file = options.camera or beside.camera, options.pen or beside.pen
    if camera_file is None:
        raise lacking("--camera")
    if pen_file is None:
        raise lacking("--pen")
    camera = read_camera(camera_file)
    pen = read_pen(pen_file, options.units, options.led_diameter, None)
    if options.tip is None:
        return _Listened(images, RegionOfInterest(camera, pen, mask), None)
    calibration = with_status(read_calibration(options.tip), local_now())
    viewers = viewers_of_camera(camera, camera_file)
    bending = bending_of(calibration)
    instrument = instrument_of(calibration, viewers, pen, pen_file, bending=bending)
    tip = StreamedTip(
        Names(pen=calibration.names.pen, tip=calibration.names.tip),
        instrument,
        tip_metadata(calibration),
    )
    return _Listened(
        images, RegionOfInterest(instrument.camera, instrument.pen, mask), tip
    )


def _play(listened: _Listened, stream: PoseStream) -> None:
    """Detect the pen in all images and send its pose to the clients."""
    failures: list[LightpenError] = []

    def note(event: WorkerEvent) -> None:
        if isinstance(event, Failed):
            failures.append(event.error)
        elif isinstance(event, FaultRaised):
            print(shown(f"lightpen: {event.error}"), file=sys.stderr)

    camera, pen, mask = (
        listened.region.camera,
        listened.region.pen,
        listened.region.mask,
    )
    if camera is None or pen is None:
        raise ValueError("It must be known what is looked for.")
    worker = CameraWorker(listened.images, CameraSettings(), note)
    worker.measure(True)
    worker.start()
    before: PenDetection | None = None
    try:
        while True:
            with suppress(FrameTimeout):
                frame = worker.next_frame(LONGEST_WAIT)
                if not camera.fits(frame.image):
                    height, width = frame.image.shape
                    raise UsageError(
                        "stream.another-size",
                        width=width,
                        height=height,
                        its_width=camera.width,
                        its_height=camera.height,
                    )
                before = detect_pen(
                    frame.image, camera, pen, mask, before, frame.full_scale
                )
                stream.process_image(frame, before)
    except EndOfImages:
        if failures:
            raise failures[-1] from None
    finally:
        worker.stop()
