"""An interrupted verification: read back to resume it.

Points are measured again from the LED centres in the record of the session, which gives
the same results. An incomplete point does not count. Fixed lamps are searched again in
the images.
"""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from lightpen.cameras.protocol import Frame
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.detection.rig_observations import see_together
from lightpen.errors import LightpenError, UsageError
from lightpen.messages import printable
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.swings.reading import Record, RecordedImage, open_record
from lightpen.swing.preparation import Preparation
from lightpen_extensions.measure.probing.current_tip import (
    CurrentTip,
    read_tip_in_force,
)
from lightpen_extensions.measure.probing.drift_reference import (
    LampDrift,
    LampObservations,
    lamps_in,
)
from lightpen_extensions.measure.probing.probing import ProbingPhase, approach_of
from lightpen_extensions.measure.probing.sources import observe_place, touch_place
from lightpen_extensions.measure.session import (
    SessionSetup,
    SessionState,
    SessionTransition,
    advance_session,
    run_again,
    setup_of,
    touch_again,
    with_drift,
)
from lightpen_extensions.measure.storage.session_record import (
    SessionRecord,
    VerificationCheckpoint,
    point_image_name,
    written_since,
)
from lightpen_extensions.measure.tasks.probed_point import ProbingFrame, StillFrames


@dataclass(frozen=True, eq=False)
class ResumedVerification:
    """State of a verification at its interruption."""

    under_way: VerificationCheckpoint
    tip: CurrentTip
    setup: SessionSetup
    state: SessionState
    files: tuple[Path, ...]  # records written of it
    lamps: LampObservations  # in the images of touches


def resume_verification(
    archive: FolderArchive,
    preparation: Preparation,
    path: Path,
    under_way: VerificationCheckpoint,
) -> ResumedVerification:
    """Return an interrupted verification, whose file is at a path, with its points.

    The preparation has the names and files of the session. Raises `LightpenError` if
    another tip is current by now, other files are chosen, or the record of the points
    cannot be read.
    """
    tip = read_tip_in_force(archive, preparation)
    _require_same(tip, under_way)
    record, setup = open_record(path.parent), setup_of(tip, under_way.choices)
    lamps = _lamps_in(record, setup)
    cameras, limits = setup.instrument.rig.cameras, setup.choices.limits
    drifted = with_drift(setup, lamps.lamp_drift(cameras, limits))
    held, state = _held_in(record, setup.rules.n_frames), SessionState()
    for run in range(1, under_way.n_runs + 1):
        state = run_again(drifted, state, [still for n, still in held if n == run])
    now = under_way.n_runs + 1
    state = touch_again(drifted, state, [still for n, still in held if n == now])
    root = path.parents[2]
    files = tuple(root / name for name in written_since(root, under_way).files)
    return ResumedVerification(under_way, tip, setup, state, files, lamps)


def _require_same(tip: CurrentTip, under_way: VerificationCheckpoint) -> None:
    names = under_way.names
    if tip.tip_file.sha256 != under_way.tip_sha256:
        raise UsageError(
            "under-way.other-tip",
            result=printable(under_way.tip_file),
            tip=printable(names.tip),
            pen=printable(names.pen),
        )
    is_pen = tip.pen_file.sha256 == under_way.pen_sha256
    if not is_pen or tip.viewers.hashes != under_way.seen_by:
        raise UsageError("under-way.other-files")


def _lamps_in(record: Record, setup: SessionSetup) -> LampObservations:
    """Return the lamps in the images of a record; empty if they are missing."""
    with suppress(LightpenError):  # the touches are known without their images
        place = touch_place((str(record.folder),))
        return lamps_in(observe_place(place, setup.instrument))
    return LampObservations()


def _held_in(record: Record, n_frames: int) -> list[tuple[int, StillFrames]]:
    """Return the points in a record that are complete, with their runs."""
    by_point: dict[int, list[RecordedImage]] = {}
    for image in record.used_images:
        by_point.setdefault(image.touch, []).append(image)
    return [
        (own[0].run, StillFrames(tuple(map(_frame, own)), (), own[0].approach_cam))
        for own in by_point.values()
        if len(own) >= n_frames
    ]


def _frame(image: RecordedImage) -> ProbingFrame:
    return ProbingFrame(
        point_image_name(image.number),
        image.rig_pixels,
        image.rotation,
        image.translation,
    )


class LivePoints:
    """Takes the images of one verification after another."""

    def __init__(self) -> None:
        self._lamps = LampObservations()

    def begin(self, lamps: LampObservations) -> None:
        """Begin another verification, with the lamps observed so far."""
        self._lamps = lamps

    def lamp_drift(self, setup: SessionSetup) -> LampDrift | None:
        """Return the drift of fixed lamps."""
        cameras = setup.instrument.rig.cameras
        return self._lamps.lamp_drift(cameras, setup.choices.limits)

    def take(
        self,
        images: SessionRecord,
        setup: SessionSetup,
        state: SessionState,
        frame: Frame,
        detection: PenDetection,
        region: RegionOfInterest,
    ) -> SessionTransition:
        """Process an image and return the transition of the verification.

        An image of a point is put on the disk before it counts.
        """
        touching, rules = state.touching, setup.rules
        is_holding = touching.phase is ProbingPhase.HOLDING
        if is_holding:
            self._lamps = self._lamps.with_frame(frame, detection, region)
        seen = see_together(setup.instrument.rig, setup.instrument.pen, detection)
        name, n_held = str(frame.seq), len(touching.held)
        may_count = is_holding and n_held >= rules.n_settling
        if may_count and seen.has_pose and not seen.is_blurred:
            tip_cam = seen.rotation @ setup.instrument.tip_pen + seen.translation
            name = images.keep(frame, seen, approach_of(touching, tip_cam))
        if n_held + 1 >= rules.n_settling + rules.n_frames:  # a point may end
            setup = with_drift(setup, self.lamp_drift(setup))
        transition = advance_session(setup, state, name, seen)
        images.follow(state, transition)
        return transition
