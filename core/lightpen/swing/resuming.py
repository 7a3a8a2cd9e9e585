"""Reading an interrupted swing back, to resume it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lightpen.cameras.sources import source_named
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig
from lightpen.record.swings.header import damaged_file
from lightpen.record.swings.journal import JOURNAL
from lightpen.record.swings.reading import (
    Record,
    is_of_recording,
    is_press_test,
    open_record,
    recorded_limits,
)
from lightpen.record.swings.recorded_source import source
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.capture.kept_images import kept_before
from lightpen.swing.capture.rules import start_again
from lightpen.swing.capture.shortfall import limits_for_more
from lightpen.swing.capture.state import SwingSetup, SwingState
from lightpen.swing.image_sources import SourceChoice

ROUNDING = 1e-6  # of a rotation


@dataclass(frozen=True, eq=False)
class Resumable:
    """An interrupted swing, ready to be resumed."""

    record: Record
    setup: SwingSetup  # of the record's own files
    state: SwingState  # with all images in the journal
    rig_file: RigFile | None = None  # the record's own copy; None of a single camera

    @property
    def source_choices(self) -> tuple[SourceChoice, ...]:
        """The source of each camera; none where this version does not know one."""
        settings, choices = self.record.header.settings, []
        for which in ("", "second_")[: self.setup.rig.n_cameras]:
            kind = settings.get(f"{which}source")
            place = settings.get(f"{which}source_place")
            if not isinstance(kind, str) or source_named(kind) is None:
                return ()
            choices.append(SourceChoice(kind, place if isinstance(place, str) else ""))
        return tuple(choices)

    def is_of(self, sources: Sequence[SourceChoice]) -> bool:
        """Return whether images of these sources can continue it."""
        if len(sources) != self.setup.rig.n_cameras:
            return False
        source, settings = sources[0], self.record.header.settings
        kind, place = settings.get("source"), settings.get("source_place")
        return source.kind == kind and (
            not self.setup.is_recording or source.place == place
        )

    def fits(self, image_size: tuple[int, int]) -> bool:
        """Return whether images of this width and height, px, can continue it."""
        return image_size == self.setup.camera.image_size


def read_resumable(folder: Path) -> Resumable:
    """Read an interrupted swing and fit its images again."""
    record = open_record(folder)
    setup = recorded_setup(record)
    if not _shows(record, setup.pen, setup.rig):
        raise damaged_file(folder / JOURNAL)
    if record.more is not None:
        min_images, max_images = record.more
        limits = replace(setup.limits, min_images=min_images, max_images=max_images)
        setup = replace(setup, limits=limits)
    found = source(record)
    rig_file = None
    if found.rig_file is not None:
        rig_file = read_rig(found.rig_file, found.camera_files)
    return Resumable(record, setup, resume_swing(setup, record), rig_file)


def read_for_more(folder: Path) -> Resumable:
    """Read a complete swing, to capture more images.

    The record notes it, so that the swing continues likewise when it is interrupted.
    """
    swing = read_resumable(folder)
    limits = limits_for_more(swing.setup.limits, swing.state.n_kept)
    with RecordWriter.resume(swing.record) as writer:
        writer.ask_for_more(limits.min_images, limits.max_images)
    setup = replace(swing.setup, limits=limits)
    return replace(swing, record=open_record(folder), setup=setup)


def _shows(record: Record, pen: Pen, rig: Rig) -> bool:
    """Return whether the journal can be of this pen before these cameras."""
    for image in record.images:
        R, t = image.rotation, image.translation
        if image.rig_pixels.shape[:2] != (rig.n_cameras, pen.n_leds):
            return False
        if not np.allclose(R.T @ R, np.eye(3), rtol=0, atol=ROUNDING):
            return False
        leds_rig = pen.leds @ R.T + t
        depths = leds_rig @ rig.rotations[:, 2].T + rig.translations[:, 2]
        if depths.min(axis=0).max() <= 0:  # behind all of them
            return False
    return True


def resume_swing(setup: SwingSetup, record: Record, time: float = 0.0) -> SwingState:
    """Return an interrupted swing with all images that its record acknowledged.

    The setup has the record's own camera and pen.
    """
    images = record.used_images
    kept = kept_before(
        setup.rig,
        setup.pen,
        record.numbers,
        np.array([image.rig_pixels for image in images]),
        np.array([image.rotation for image in images]),
        np.array([image.translation for image in images]),
        setup.assumptions,
    )
    return start_again(setup, kept, record.next_number, time)


def recorded_setup(record: Record) -> SwingSetup:
    """Return the setup of a record, from its own copies of the files."""
    found = source(record)
    return SwingSetup(
        found.camera,
        found.pen,
        recorded_limits(record),
        found.masks[0],
        assumptions=found.assumptions,
        is_recording=is_of_recording(record),
        beside=found.rig,
        other_masks=found.masks[1:],
        is_press_test=is_press_test(record),
    )
