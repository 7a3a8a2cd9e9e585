"""What a calibration needs before the swing, and how a record brings it back."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from lightpen.errors import FileError
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.model.limits import SwingLimits
from lightpen.model.names import Origin
from lightpen.record.swings.header import Names
from lightpen.record.swings.reading import Record, open_record
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.preparation import (
    NO_SOURCE,
    MissingInput,
    Preparation,
    SourceChoice,
    SourceKind,
)
from lightpen.swing.swing_recorder import record_header, recorded_setup
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene

NAMES = Names("Hall 2", "Zoë", "LP-04", "T-10", "C-1", 3.0005)
ODD = 'Ä/\\ 王 "%" ' + 200 * "w"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Preparation:
    """A preparation that lacks nothing."""
    scene = Scene()
    files = write_sample_files(scene, tmp_path_factory.mktemp("files"))
    return Preparation(
        names=NAMES,
        image_size=(scene.camera.width, scene.camera.height),
        camera_file=CameraFile.read(files.camera),
        pen_file=PenFile.read(files.pen),
    )


def recorded(preparation: Preparation, folder: Path) -> Record:
    RecordWriter.create(folder, record_header(preparation)).close()
    return open_record(folder)


def test_a_whole_preparation_lacks_nothing(whole: Preparation) -> None:
    assert whole.missing_inputs() == ()


def test_at_first_all_is_missing_in_the_order_of_the_steps() -> None:
    assert Preparation().missing_inputs() == (
        *(
            MissingInput.STATION,
            MissingInput.OPERATOR,
            MissingInput.PEN,
            MissingInput.TIP,
            MissingInput.CONE,
        ),
        *(MissingInput.IMAGES, MissingInput.CAMERA_FILE, MissingInput.PEN_FILE),
    )


def test_a_source_must_be_chosen_before_its_images_are_missed(
    whole: Preparation,
) -> None:
    sourceless = replace(whole, source=NO_SOURCE, image_size=None)

    assert sourceless.camera_missing_inputs() == (MissingInput.SOURCE,)


@pytest.mark.parametrize("blank", ["", "  \t"])
@pytest.mark.parametrize("lack", list(MissingInput)[:5])
def test_each_name_must_be_given(
    whole: Preparation, lack: MissingInput, blank: str
) -> None:
    texts = {"station": "S", "operator": "O", "pen": "P", "tip": "T", "cone": "C"}
    names = Names(**(texts | {str(lack): blank}), ball_diameter=3.0)

    assert replace(whole, names=names).start_missing_inputs() == (lack,)


def test_a_ball_diameter_and_a_nominal_tip_need_not_be_known(
    whole: Preparation,
) -> None:
    names = replace(NAMES, ball_diameter=None)

    assert replace(whole, names=names, nominal_tip=None).missing_inputs() == ()


def test_a_camera_must_send_images(whole: Preparation) -> None:
    assert replace(whole, image_size=None).missing_inputs() == (MissingInput.IMAGES,)


def test_a_recording_must_be_chosen_before_its_images_are_missed(
    whole: Preparation,
) -> None:
    nowhere = replace(whole, source=SourceChoice(SourceKind.RECORDED), image_size=None)
    chosen = replace(nowhere, source=SourceChoice(SourceKind.RECORDED, "/images"))

    assert nowhere.camera_missing_inputs() == (MissingInput.SOURCE_PLACE,)
    assert chosen.camera_missing_inputs() == (MissingInput.IMAGES,)


def test_images_must_have_the_size_of_the_intrinsics(whole: Preparation) -> None:
    assert replace(whole, image_size=(1224, 1024)).missing_inputs() == (
        MissingInput.IMAGE_SIZE,
    )


def test_a_size_that_is_not_known_yet_is_no_wrong_one(whole: Preparation) -> None:
    assert (
        MissingInput.IMAGE_SIZE not in replace(whole, image_size=None).missing_inputs()
    )


def test_both_files_must_be_chosen(whole: Preparation) -> None:
    assert replace(whole, camera_file=None).missing_inputs() == (
        MissingInput.CAMERA_FILE,
    )
    assert replace(whole, pen_file=None).missing_inputs() == (MissingInput.PEN_FILE,)


def test_no_swing_begins_without_both_files(whole: Preparation) -> None:
    for part in (replace(whole, camera_file=None), replace(whole, pen_file=None)):
        with pytest.raises(ValueError, match="must be chosen"):
            part.swing_setup()
        with pytest.raises(ValueError, match="must be chosen"):
            record_header(part)


def test_a_nominal_tip_takes_the_place_of_that_of_the_file(whole: Preparation) -> None:
    given = np.array([0.1, -90.0, -25.0])
    assert whole.pen is not None
    assert whole.pen_file is not None

    changed = replace(whole, nominal_tip=given).pen

    assert changed is not None
    np.testing.assert_array_equal(changed.nominal_tip, given)
    np.testing.assert_array_equal(whole.pen.nominal_tip, whole.pen_file.pen.nominal_tip)


def test_a_swing_goes_by_names_files_limits_mask_and_nominal_tip(
    whole: Preparation,
) -> None:
    tip = np.array([0.0, 140.0, 2.0])
    assert whole.camera_file is not None
    assert whole.pen_file is not None
    assert whole.swings_like(replace(whole, image_size=None))
    assert replace(whole, nominal_tip=tip).swings_like(
        replace(whole, nominal_tip=tip.copy())
    )
    elsewhere = SourceChoice(SourceKind.RECORDED, "another folder")
    others = (
        replace(whole, source=elsewhere),
        replace(whole, names=replace(NAMES, tip="T-11")),
        replace(whole, camera_file=CameraFile.read(whole.camera_file.path)),
        replace(whole, pen_file=PenFile.read(whole.pen_file.path)),
        replace(whole, limits=SwingLimits(max_images=200)),
        replace(whole, mask=np.array([[10.0, 20.0, 5.0]])),
        replace(whole, nominal_tip=tip),
    )
    assert not any(whole.swings_like(other) for other in others)
    assert not replace(whole, nominal_tip=tip).swings_like(whole)


@pytest.mark.parametrize("name", [ODD, "", "王", "a\tb"])
def test_a_record_brings_its_names_back(
    whole: Preparation, tmp_path: Path, name: str
) -> None:
    names = Names(name, name, name, name, name, 3.0005)

    record = recorded(replace(whole, names=names), tmp_path / "swing")

    assert record.header.names == names


def test_a_record_brings_its_setup_back_to_the_last_digit(
    whole: Preparation, tmp_path: Path
) -> None:
    limits = SwingLimits(1 / 300, 61, 299, 3, 0.1 / 3)
    preparation = replace(
        whole,
        nominal_tip=np.array([0.1, -90.0, -25.0]) / 3,
        mask=np.array([[10.0, 20.0, 5.5]]) / 3,
        limits=limits,
    )
    given = preparation.swing_setup()

    setup = recorded_setup(recorded(preparation, tmp_path / "swing"))

    assert setup.limits == limits
    np.testing.assert_array_equal(setup.mask, given.mask)
    for each in fields(given.camera):
        np.testing.assert_array_equal(
            getattr(setup.camera, each.name), getattr(given.camera, each.name)
        )
    for name in ("leds", "nominal_tip"):
        np.testing.assert_array_equal(
            getattr(setup.pen, name), getattr(given.pen, name)
        )


def test_a_file_that_vanished_since_is_reported_when_a_record_begins(
    whole: Preparation, tmp_path: Path
) -> None:
    assert whole.pen_file is not None
    gone = replace(whole.pen_file, path=tmp_path / "gone.csv")

    with pytest.raises(FileError, match=r"LED file .*gone\.csv does not exist"):
        record_header(replace(whole, pen_file=gone))


# What images are of, and what belongs to a tip


def test_nothing_is_real_that_needs_a_simulated_file(prepared: Preparation) -> None:
    assert prepared.origin is Origin.SIMULATED
    recorded = SourceChoice(SourceKind.RECORDED, "swing")
    assert replace(prepared, source=recorded).origin is Origin.SIMULATED

    bare = replace(prepared, source=recorded, camera_file=None, pen_file=None)
    assert bare.origin is Origin.RECORDED


def test_another_source_has_neither_the_simulated_files_nor_the_stray_light(
    prepared: Preparation,
) -> None:
    masked = replace(prepared, mask=np.ones((1, 3)))
    recorded = SourceChoice(SourceKind.RECORDED, "swing")
    chosen = masked.with_source(recorded)

    assert (chosen.camera_file, chosen.pen_file) == (None, None)
    assert len(chosen.mask) == 0
    assert masked.with_source(masked.source) is masked


def test_files_of_a_real_pen_stay_with_other_recordings_and_go_with_the_simulated(
    prepared: Preparation,
) -> None:
    assert prepared.camera_file is not None
    camera_file = replace(prepared.camera_file, is_simulated=False)
    first = SourceChoice(SourceKind.RECORDED, "one")
    real = replace(prepared, source=first, camera_file=camera_file)

    other = real.with_source(SourceChoice(SourceKind.RECORDED, "other"))
    assert other.camera_file is camera_file
    assert real.with_source(SourceChoice()).camera_file is None


def test_another_tip_forgets_ball_and_nominal_centre(prepared: Preparation) -> None:
    before = replace(prepared, nominal_tip=np.ones(3))
    same = before.renamed(replace(before.names, cone="C-2"))
    assert (same.names.ball_diameter, same.nominal_tip) == (10.0, before.nominal_tip)

    other = before.renamed(replace(before.names, tip="T-2"))
    assert (other.names.ball_diameter, other.nominal_tip) == (None, None)

    given = before.renamed(replace(before.names, tip="T-2", ball_diameter=3.0))
    assert given.names.ball_diameter == 3.0

    unnamed = replace(before, names=replace(before.names, tip="", ball_diameter=8.0))
    first = unnamed.renamed(replace(unnamed.names, tip="T-2"))
    assert first.names.ball_diameter == 8.0
    assert first.nominal_tip is before.nominal_tip


def test_the_temperature_of_the_pen_counts_for_the_day_on_which_it_is_stated(
    whole: Preparation,
) -> None:
    limits = replace(whole.limits, requires_temperature=True)
    live = replace(
        whole,
        source=SourceChoice("aravis", "1"),
        camera_file=None,
        pen_file=None,
        limits=limits,
    )
    assert live.asks_temperature
    assert live.lacks_temperature

    stated = live.with_temperature(21.5)
    assert not stated.asks_temperature
    assert not stated.lacks_temperature
    assert stated.assumptions_today.temperature_c == 21.5
    unmeasured = live.with_temperature(None)
    assert not unmeasured.asks_temperature
    assert unmeasured.lacks_temperature

    old = replace(stated, temperature_day="2020-01-01")
    assert old.asks_temperature
    assert old.assumptions_today.temperature_c is None
    assert not old.swings_like(stated)
    finer = replace(old.assumptions_today, focal_length=0.001)
    assert old.with_assumptions(finer).asks_temperature
    warmer = replace(finer, temperature_c=25.0)
    assert old.with_assumptions(warmer).assumptions_today == warmer


def test_a_simulated_or_recorded_swing_is_not_asked_for_its_temperature(
    whole: Preparation,
) -> None:
    assert not whole.asks_temperature
