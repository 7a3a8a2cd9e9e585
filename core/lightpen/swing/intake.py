"""The open record of a swing: which images of its source go there, and how."""

from functools import partial
from hashlib import sha256

from lightpen.cameras.protocol import Frame, Stats
from lightpen.detection.sighting import Sighting
from lightpen.formats.decoding import encode_png
from lightpen.record.reading import DISCARDED, Record
from lightpen.record.writing import OtherView, RecordWriter
from lightpen.swing.capture import Rule, capture_image
from lightpen.swing.recorded import pass_over, take_recorded_image
from lightpen.swing.rules import Transition
from lightpen.swing.state import Phase, SwingSetup, SwingState
from lightpen.swing.tally import Tally


class Intake:
    """A record that takes in the images of its swing, until it is closed.

    Raises
    ------
    RecordError
        If the record cannot be opened for writing.
    """

    def __init__(self, record: Record) -> None:
        self._writer = RecordWriter.resume(record)
        self._tally = Tally(record.stats)
        self._known = frozenset(image.sha256 for image in record.images)
        self._n_others = 0  # images of a recording since the last that was read

    def capture(
        self,
        setup: SwingSetup,
        before: SwingState,
        frame: Frame,
        sighting: Sighting,
        n_images: int | None,
        stats: Stats | None,
    ) -> Transition | None:
        """Return what an image does to the swing, once what is kept of it is stored.

        `n_images` are those of the recording that the image is of. None for an image
        that is not of this swing.

        Raises
        ------
        LightpenError
            If the image cannot be stored.
        """
        if stats is not None:
            self._tally = self._tally.after(stats)
        rule: Rule | None = None
        if setup.is_recording:
            if n_images is None or before.phase is Phase.PAUSED:
                return None
            if frame.seq % n_images != before.progress.n_read:
                return self._wait(before, n_images)
            self._n_others = 0
            is_known = self._is_known(frame)
            rule = partial(take_recorded_image, n_images=n_images, is_known=is_known)
        time = frame.host_ts_ns * 1e-9
        return capture_image(
            *(setup, before, self._writer, frame.image, sighting, time),
            *(frame.device_ts_ns, self._tally.total, rule),
            _others(frame, sighting),
        )

    def _wait(self, before: SwingState, n_images: int) -> Transition | None:
        """Let an image of a recording go by whose turn it is not.

        The recording is shown over and over; each image is read once, in its order.
        One that does not come in a whole pass cannot be read, and is passed over.
        """
        self._n_others += 1
        if self._n_others <= n_images:
            return None
        self._n_others = 0
        return pass_over(before, n_images)

    def _is_known(self, frame: Frame) -> bool:
        """Return whether a recorded image was taken before an interruption."""
        if not self._known:
            return False
        return sha256(encode_png(frame.image)).hexdigest() in self._known

    def discard(self) -> None:
        """Note that the swing was left for good."""
        self._writer.conclude(DISCARDED)

    def close(self) -> None:
        """Leave the record as it is on the disk."""
        self._writer.close()


def _others(frame: Frame, sighting: Sighting) -> tuple[OtherView, ...]:
    return tuple(
        OtherView(other.image, seen.pixels, other.device_ts_ns)
        for other, seen in zip(frame.others, sighting.others, strict=True)
    )
