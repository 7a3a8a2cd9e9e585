"""The owner of a swing, from its first image to the accepted tip.

Its own thread runs the workflow. Commands and images reach it through one queue:
an accepted image is on the disk before the next is taken. A listener is notified of
every change and event. Solving and reading run in the background; all other work on
the disk is done between two images.
"""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from lightpen.archive.lazy_logbook import LazyLogbook
from lightpen.cameras.protocol import Frame, Stats
from lightpen.detection.pen_detection import PenDetection
from lightpen.local_time import local_now
from lightpen.record.results.result_folder import FolderArchive
from lightpen.runners import WorkflowRunner
from lightpen.swing.capture.state import SwingSetup
from lightpen.swing.status import SwingListener, SwingStatus
from lightpen.swing.workflow import SwingWorkflow


class SwingRunner(WorkflowRunner[SwingWorkflow]):
    """Captures, solves and accepts one swing after another.

    Every method returns at once, except `process_image` and `await_end`. A command that
    is not possible in the state of the swing by then is ignored. See `SwingWorkflow`.
    """

    def __init__(
        self,
        records: Path,
        archive: FolderArchive,
        listener: SwingListener,
        now: Callable[[], datetime] = local_now,
        logbook: LazyLogbook | None = None,
    ) -> None:
        super().__init__(
            "swing",
            lambda start: SwingWorkflow(
                records, archive, listener, now, start, logbook
            ),
        )

    @property
    def status(self) -> SwingStatus:
        """The last published status; thread-safe."""
        return self._workflow.status

    def process_image(
        self,
        frame: Frame,
        detection: PenDetection | None,
        setup: SwingSetup | None = None,
        n_images: int | None = None,
        stats: Stats | None = None,
    ) -> None:
        """Process an image; returns when it is done.

        The detection is None if the image has the wrong size; images of another setup
        are ignored. A recording of ``n_images``, which is replayed in a loop, ends the
        swing with its last image. ``stats`` are the counters of the camera at this
        image.
        """
        self._queue.ask_and_wait(
            lambda: self._workflow.process_image(
                frame, detection, setup, n_images, stats
            )
        )
