"""Tests of reading LED centres and poses."""

import contextlib
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, LightpenError
from lightpen.formats.observation_files import read_centers, read_poses
from lightpen.model.rigid import rotation_from_vector

HEADER = "frame,led,x_px,y_px"
POSE_HEADER = "pose,r11,r12,r13,r21,r22,r23,r31,r32,r33,tx_mm,ty_mm,tz_mm"


def saved(folder: Path, *lines: str) -> Path:
    path = folder / "obs.csv"
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


def rotations(n: int) -> FloatArray:
    return rotation_from_vector(np.random.default_rng(n).normal(size=(n, 3)))


def cells(*arrays: FloatArray) -> str:
    return ",".join(repr(x) for array in arrays for x in array.ravel().tolist())


def pose_lines(n: int) -> list[str]:
    return [
        f"{i},{cells(R, np.array([1.5, -2.0, 900.0]))}"
        for i, R in enumerate(rotations(n), 1)
    ]


def refusal_of_centers(folder: Path, *lines: str) -> str:
    with pytest.raises(FileError) as info:
        read_centers(saved(folder, *lines), 3)
    return str(info.value)


def refusal_of_poses(folder: Path, *lines: str) -> str:
    with pytest.raises(FileError) as info:
        read_poses(saved(folder, *lines))
    return str(info.value)


@pytest.mark.parametrize(
    "lines",
    [
        (HEADER, "7,1,1.5,2.5", "2,1,3,4", "7,3,5,6"),
        ("7,1,1.5,2.5", "2,1,3,4", "7,3,5,6"),
        ("y;led;x;frame", "2,5;1;1,5;7", "4;1;3;2", "6;3;5;7"),
        (HEADER + ",sigma", "7,1,1.5,2.5,a", "2,1,3,4,b", "7,3,5,6,c"),
        (HEADER + ",,", "7,1,1.5,2.5,,", "2,1,3,4,,", "7,3,5,6,,", ",,,,,"),
        (
            "% MATLAB",
            "time,frame,led,x [px],y [px]",
            "0,7,1,1.5,2.5",
            "0,2,1,3,4",
            "0,7,3,5,6",
        ),
        (HEADER, "a_07.png,LED1,1.5,2.5", "a_02.png,LED1,3,4", "a_07.png,LED3,5,6"),
        (HEADER, "/a/07.png,#1,1.5,2.5", "/a/02.png,#1,3,4", "/a/07.png,#3,5,6"),
        ("frame led x y", "0 7 1 1.5 2.5", "1 2 1 3.0 4.0", "2 7 3 5.0 6.0"),
        ('"frame\nno.",led,"x\n[px]","y\n[px]"', "7,1,1.5,2.5", "2,1,3,4", "7,3,5,6"),
        (HEADER, "7,1,1.5,2.5", "8,,,", "2,1,3,4", "7,3,5,6"),
        (HEADER + ",x1,y1,x2,y2", "7,1,1.5,2.5,0,0,0,0", "2,1,3,4,,,,", "7,3,5,6,,,,"),
        ("frame,x1,y1,x3,y3", "7,1.5,2.5,5,6", "2,3,4,,"),
        ("frame,u1,v1,u3,v3", "7,1.5,2.5,5,6", "2,3,4,,"),
        ("led3_x,led3_y,led1_x,led1_y,t", "5,6,1.5,2.5,7", "NaN,NaN,3,4,2"),
        (
            "Frame,Feature 1 - X (px),Feature 1 - Y (px),Point#3 x,Point#3 y",
            *("7,1.5,2.5,5,6", "2,3,4,,"),
        ),
        ("t;LED 1;;LED 3;", ";x;y;x;y", "7;1.5;2.5;5;6", "2;3;4;;"),
        (";LED 1;;LED 3;", "t;x;y;x;y", "7;1.5;2.5;5;6", "2;3;4;;"),
        ("t;LED 1/X;LED 1/Y;LED 3/X;LED 3/Y", "7;1.5;2.5;5;6", "2;3;4;;"),
        ("frame_idx;x1 [px];x3 [px];y1 [px];y3 [px]", "7;1,5;5;2,5;6", "2;3;-1;4;-1"),
        ("frame_index,particle,y,x", "7,1,2.5,1.5", "2,1,4,3", "7,3,6,5"),
        ("frame,led,x,y", "[-],[-],[px],[px]", "7,1,1.5,2.5", "2,1,3,4", "7,3,5,6"),
        (HEADER, "7,1,1.5,2.5", HEADER.upper(), "2,1,3,4", "7,3,5,6"),
        (HEADER + ",visible", "7,1,1.5,2.5,1", "2,1,3,4,1", "7,3,5,6,1", "7,2,8,9,0"),
        (HEADER + ",track,invalid", *("7,1,1.5,2.5,0,0", "2,1,3,4,0,0", "7,3,5,6,0,0")),
    ],
    ids=[
        *("header", "no header", "other order", "more columns"),
        *("of a spreadsheet", "of MATLAB", "names", "paths", "printed by pandas"),
        *("two lines in a cell", "a frame without LEDs"),
        *(
            "of each LED, too",
            *("a line for a frame", "of u and v"),
            "names in front",
            *(
                "of ProAnalyst and TEMA",
                "two lines of names",
                "of a workbook",
                "of Kinovea",
            ),
            "with units",
            "of trackpy",
            "units",
            "joined",
            "not visible",
            "numbers of tracks",
        ),
    ],
)
def test_centres_are_sorted_by_frame_and_led(
    tmp_path: Path, lines: tuple[str, ...]
) -> None:
    path = saved(tmp_path, *lines)
    found = read_centers(path, 3)
    nan = [np.nan, np.nan]
    np.testing.assert_array_equal(found.frames, [2, 7])
    np.testing.assert_array_equal(
        found.pixels, [[[3, 4], nan, nan], [[1.5, 2.5], nan, [5, 6]]]
    )
    assert found.path == path


@pytest.mark.parametrize(
    "header",
    [
        *(
            "Bild;LED-Nr.;X [Pixel];Y [Pixel]",
            "stamp;led_id;u;v",
            "帧号;灯号;X坐标;Y坐标",
        ),
        *("frameNumber;Marker #;X-Koordinate;Y-Koordinate", "img;dot;row;column"),
        *("Slice;label;centroid-1;centroid-0", "image_file;keypoint;x_img;y_img"),
        *("Frame_ID;LED_Name;Pos_X_px;Pos_Y_px", "t;led;u;v;X;Y;Z"),
        *("t_ms;led;x;y", "elapsed (s);led;x;y", "img_idx;pt_idx;px;py"),
    ],
)
def test_columns_have_the_names_that_people_write(tmp_path: Path, header: str) -> None:
    columns = header.split(";")
    line = "7;LED2;2.5;1.5" if columns[2] == "row" else "7;LED2;1.5;2.5"
    line += ";30;40;500" * (len(columns) > 4)
    found = read_centers(saved(tmp_path, header, line), 2)
    assert found.frames.tolist() == [7]
    assert found.pixels[0, 1].tolist() == [1.5, 2.5]


def test_corners_of_boxes_are_no_centres(tmp_path: Path) -> None:
    lines = ("frame,led,x,y,w,h,cx,cy", "3,1,10,20,5,5,12.25,22.5")
    found = read_centers(saved(tmp_path, *lines), 1)
    assert found.pixels.tolist() == [[[12.25, 22.5]]]
    said = refusal_of_centers(tmp_path, "frame,led,x,y,w,h", "3,1,10,20,5,5")
    assert "column w: its whole numbers x and y seem to be the corners" in said
    named = saved(tmp_path, "frame,led,x,y,w,h", "3,1,10.5,20,5,5")
    assert read_centers(named, 1).pixels.tolist() == [[[10.5, 20]]]


def test_lines_about_the_recording_may_stand_above(tmp_path: Path) -> None:
    lines = ("File,a.avi", "Resolution,2448,2048", "", "Frame,LED,X,Y", "3,1,1.5,2.5")
    assert read_centers(saved(tmp_path, *lines), 1).frames.tolist() == [3]


def test_the_largest_numbers_lie_outside_every_image(tmp_path: Path) -> None:
    said = refusal_of_centers(tmp_path, HEADER, "1,1,1.7e308,1.7e308")
    assert "lies outside every image" in said


def test_a_frame_without_number_is_that_of_the_line_above(tmp_path: Path) -> None:
    """A spreadsheet names it in the first cell of those that were merged."""
    rows = ("1;1;10;20", ";2;30;40", "2;1;11;21", ";2;31;41")
    found = read_centers(saved(tmp_path, "frame;led;x;y", *rows), 2)
    assert found.frames.tolist() == [1, 2]
    assert found.pixels[:, 1].tolist() == [[30, 40], [31, 41]]


def test_names_of_columns_may_be_in_shift_jis(tmp_path: Path) -> None:
    path = tmp_path / "centres.csv"
    text = "フレーム,LED番号,X座標,Y座標\n3,1,1.5,2.5\n"
    path.write_bytes(text.encode("shift_jis"))
    assert read_centers(path, 1).pixels.tolist() == [[[1.5, 2.5]]]


@pytest.mark.parametrize(
    "unseen",
    [
        *("-1,-1", "0,0", ",", "nan,nan", "NaN,", "#N/A,#N/A", "-9999,-9999"),
        *("inf,inf", "-nan(ind),-nan(ind)", "-nan,-nan", "1.#QNAN,1.#QNAN"),
        *("-1,200", "9999,9999", "65535,65535", "-9999.9999,-9999.9999"),
        *("#DIV/0!,#DIV/0!", "#WERT!,#WERT!"),
    ],
)
def test_centres_of_leds_that_are_not_seen_are_left_out_and_counted(
    tmp_path: Path, unseen: str
) -> None:
    path = saved(tmp_path, HEADER, "7,1,1.5,2.5", f"7,2,{unseen}", "7,3,5,6")

    found = read_centers(path, 3)

    nan = [np.nan, np.nan]
    np.testing.assert_array_equal(found.pixels, [[[1.5, 2.5], nan, [5, 6]]])


@pytest.mark.parametrize("name", ["{}", "LED {}", "led_{}"])
def test_leds_may_be_called_by_letters(tmp_path: Path, name: str) -> None:
    leds = [name.format(letter) for letter in "CAB"]
    rows = [f"7,{led},{x},2" for led, x in zip(leds, (3, 1, 2), strict=True)]

    found = read_centers(saved(tmp_path, HEADER, *rows), 3)

    np.testing.assert_array_equal(found.pixels[0, :, 0], [1, 2, 3])


def test_names_of_leds_without_order_are_refused(tmp_path: Path) -> None:
    refusal = refusal_of_centers(tmp_path, HEADER, "7,A,1,2", "7,front left,3,4")
    assert "Number the LEDs" in refusal


@pytest.mark.parametrize("least", [0.4, -2.1])
def test_shares_of_an_image_are_no_pixels(tmp_path: Path, least: float) -> None:
    rows = [f"{n},1,{least + n / 100},0.5" for n in range(30)]
    assert "shares of the image, or in mm" in refusal_of_centers(
        tmp_path, HEADER, *rows
    )


def test_json_is_named_where_a_table_is_read(tmp_path: Path) -> None:
    assert "is JSON" in refusal_of_centers(tmp_path, '[{"frame": 1, "leds": []}]')


@pytest.mark.parametrize(
    ("start", "program"),
    [
        ('<?xml version="1.0"?>\n<TrackMate version="7">', "TrackMate"),
        ("<Kinovea>", "XML"),
        ("LABEL,ID,TRACK_ID,QUALITY\nLabel,Spot ID,Track ID,Quality\n", "TrackMate"),
        ("NO_OF_FRAMES\t60", "Qualisys"),
        ("Format Version,1.23,Take Name,a", "Motive"),
        ("Trajectories\n100\n,,Pen:1,,", "Vicon"),
        ("# Image list with two lines of data per image:", "COLMAP"),
        ("pt1_cam1_X,pt1_cam1_Y\n1,2", "DLTdv"),
        ("mass_A\t\t\tmass_B\nt\tx\ty\tt\tx\ty\n", "Tracker"),
        (" ,Area,Mean,X,Y,Slice\n1,1340,200,5,6,1", "ImageJ"),
        ("- frame: 1\n  leds:\n", "YAML"),
        ("[[frame]]\nn = 1\n", "TOML"),
        ("[[1.3e+03 1.6e+03]\n [1.4e+03 1.3e+03]]", "numpy"),
        ("centers = [\n 1 1 2 3;\n];", "MATLAB"),
    ],
)
def test_centres_of_other_programs_are_named(
    tmp_path: Path, start: str, program: str
) -> None:
    refusal = refusal_of_centers(tmp_path, start)
    assert f"of the kind {program}" in refusal
    assert "a table with the header frame,led,x_px,y_px" in refusal


def test_times_are_frames(tmp_path: Path) -> None:
    nanoseconds = ("1764380000123456789", "1764380000123456790")
    rows = [f"{each},1,2,3" for each in nanoseconds]
    assert len(read_centers(saved(tmp_path, HEADER, *rows), 3).frames) == 2

    rows = [f"2024-03-01T12:00:0{each},1,2,3" for each in ("0.25Z", "1.5+01:00")]
    frames = read_centers(saved(tmp_path, HEADER, *rows), 3).frames
    assert frames[1] - frames[0] == 1_250_000_000

    rows = [f"12:00:0{each},1,2,3" for each in ("0.25", "1.5")]
    frames = read_centers(saved(tmp_path, HEADER, *rows), 3).frames
    assert frames[1] - frames[0] == 1_250_000_000

    rows = [f"{each},1,2,3" for each in ("0.05", "0.10", "0.1")]
    with pytest.raises(FileError, match="LED 1 of frame"):
        read_centers(saved(tmp_path, HEADER, *rows), 3)
    assert len(read_centers(saved(tmp_path, HEADER, *rows[:2]), 3).frames) == 2


@pytest.mark.parametrize(
    ("names", "frames"),
    [
        (("1764380000123456790.png", "1764380000123456789.png"), None),
        (("IMG_0017.JPG", "IMG_0002.JPG"), (17, 2)),
        (("0017_left.ome.tif", "0002_left.ome.tif"), (17, 2)),
        (("f17_cam1.png", "f2_cam1.png"), (2, 1)),
        (
            ("Image__2026-05-03__10-16-05.png", "Image__2026-05-03__10-15-20.png"),
            (2, 1),
        ),
        (("2026/05/03 10:15:21.050", "2026/05/03 10:15:20.950"), (2, 1)),
    ],
)
def test_names_of_images_are_frames_in_their_order(
    tmp_path: Path, names: tuple[str, str], frames: tuple[int, int] | None
) -> None:
    rows = [f"{name},1,{i},3" for i, name in enumerate(names, 1)]
    found = read_centers(saved(tmp_path, HEADER, *rows), 3)
    wanted = frames or [int(Path(name).stem) for name in names]
    np.testing.assert_array_equal(found.frames, sorted(wanted))
    np.testing.assert_array_equal(found.pixels[:, 0, 0], [2, 1])


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        (
            (HEADER, "1,1,2,3", "1,2,2,3", "1,1,5,5"),
            "Line 4 of obs.csv: LED 1 of frame",
        ),
        ((HEADER, "1,4,2,3"), "Line 2 of obs.csv: there is no LED 4; the pen has LEDs"),
        ((HEADER, "1,0,2,3"), "there is no LED 0"),
        ((HEADER, "1,1,2,3", "1,2,2,3O"), "Line 3 of obs.csv: .* is not a number"),
        ((HEADER, "1,1,2,3", "1,2,2"), "Line 3 of obs.csv has 3 cells"),
        ((HEADER, "1,1,2,3", "1,2,"), "Line 3 of obs.csv has 3 cells"),
        ((HEADER, "1,1,1e7,3"), "Line 2 of obs.csv: (1e+07, 3) px lies outside"),
        (("frame,led,a,b", "1,1,2,3"), "no column x_px; LED centres need the columns"),
        (("1,1,2", "1,2,2"), "no header and 3 columns"),
        ((HEADER,), "no rows below"),
    ],
)
def test_a_flaw_of_centres_is_named(
    tmp_path: Path, lines: tuple[str, ...], sentence: str
) -> None:
    found = refusal_of_centers(tmp_path, *lines)
    for part in sentence.split(".*"):
        assert part in found


def test_the_first_led_given_twice_is_named_with_both_lines(tmp_path: Path) -> None:
    text = refusal_of_centers(
        tmp_path, "9,1,0,0", "1,3,0,0", "9,1,0,0", "1,3,0,0", "9,1,0,0"
    )
    assert text.startswith(
        "Line 3 of obs.csv: LED 1 of frame 9 is already given on line 1"
    )


def test_more_frames_than_any_swing_has_are_refused(tmp_path: Path) -> None:
    lines = [f"{n},1,200,3" for n in range(30_001)]
    assert "has 30001 frames; at most 5000" in refusal_of_centers(tmp_path, *lines)


def test_a_huge_file_of_centres_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "obs.csv"
    with path.open("wb") as stream:
        stream.truncate(10**11)
    with pytest.raises(FileError, match="the maximum is 16 MB"):
        read_centers(path, 3)


@given(st.integers(0, 10_000))
def test_any_centres_are_read_to_the_last_digit(
    tmp_path_factory: pytest.TempPathFactory, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    n_frames = rng.integers(1, 6)
    pixels = rng.uniform(-100, 4000, (n_frames, 3, 2))
    pixels[rng.random((n_frames, 3)) < 0.3] = np.nan
    pixels[:, 1] = rng.normal(size=2)  # a frame without any LED leaves no trace
    frames = np.sort(rng.choice(1000, n_frames, replace=False)).astype(np.int64)
    path = tmp_path_factory.getbasetemp() / "digits.csv"
    rows = [
        f"{frame},{led},{x!r},{y!r}"
        for frame, leds in zip(frames, pixels.tolist(), strict=True)
        for led, (x, y) in enumerate(leds, start=1)
        if not math.isnan(x)
    ]
    path.write_text("\n".join(["frame,led,x_px,y_px", *rows]))
    found = read_centers(path, 3)
    np.testing.assert_array_equal(found.frames, frames)
    np.testing.assert_array_equal(found.pixels, pixels)


@pytest.mark.parametrize("with_number", [True, False])
@pytest.mark.parametrize("with_header", [True, False])
def test_poses_are_read(tmp_path: Path, with_number: bool, with_header: bool) -> None:
    lines = ([POSE_HEADER] if with_header else []) + pose_lines(4)
    if not with_number:
        lines = [line.split(",", 1)[1] for line in lines]
    found = read_poses(saved(tmp_path, *lines))
    np.testing.assert_array_equal(found.rotations, rotations(4))
    np.testing.assert_array_equal(found.translations, [[1.5, -2, 900]] * 4)


def test_rotations_in_few_digits_are_made_rotations(tmp_path: Path) -> None:
    exact = rotations(3)
    lines = [cells(np.round(R, 4), np.zeros(3)) for R in exact]
    found = read_poses(saved(tmp_path, *lines)).rotations
    np.testing.assert_allclose(
        found @ np.swapaxes(found, 1, 2), [np.eye(3)] * 3, atol=1e-14
    )
    np.testing.assert_allclose(found, exact, atol=1e-4)


def test_rotations_in_many_digits_stay_as_they_are(tmp_path: Path) -> None:
    rounded = np.round(rotations(3), 9)
    lines = [cells(R, np.zeros(3)) for R in rounded]
    np.testing.assert_array_equal(
        read_poses(saved(tmp_path, *lines)).rotations, rounded
    )


@pytest.mark.parametrize(
    ("matrix", "sentence"),
    [
        (np.diag([1.0, 1.0, -1.0]), "mirrored rotation (determinant -1)"),
        (np.diag([1.0, 1.0, 1.01]), "are not a rotation"),
        (np.zeros((3, 3)), "are not a rotation"),
        (np.full((3, 3), 1e300), "are not a rotation"),
    ],
)
def test_what_is_no_rotation_is_refused(
    tmp_path: Path, matrix: FloatArray, sentence: str
) -> None:
    lines = [POSE_HEADER, *pose_lines(1), f"2,{cells(matrix, np.zeros(3))}"]
    text = refusal_of_poses(tmp_path, *lines)
    assert text.startswith("Line 3 of obs.csv: r11 to r33 are")
    assert sentence in text


def test_a_translation_of_kilometres_is_refused(tmp_path: Path) -> None:
    text = refusal_of_poses(tmp_path, cells(np.eye(3), np.array([0, 0, 1e300])))
    assert "Line 1 of obs.csv: the translation is more than 1000 m" in text


def test_a_wrong_number_of_pose_columns_is_refused(tmp_path: Path) -> None:
    assert "no header and 4 columns. Poses have 7" in refusal_of_poses(
        tmp_path, "1,2,3,4"
    )


@given(
    st.binary(max_size=300) | st.text("0123456789.,;-e\n", max_size=300).map(str.encode)
)
def test_any_content_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_bytes(data)
    with contextlib.suppress(LightpenError):
        read_centers(path, 10)
    with contextlib.suppress(LightpenError):
        read_poses(path)


def test_the_shared_poses_are_kept_as_they_are(shared_data: Path) -> None:
    found = read_poses(shared_data / "pivot-poses" / "optical-tracker.csv")
    assert found.rotations.shape == (1151, 3, 3)
    assert found.rotations[0, 0, 1] == -0.9449805021
    assert found.translations[0, 2] == -2017.9345703125


def test_the_shared_centres_are_read(shared_data: Path) -> None:
    found = read_centers(shared_data / "repeat" / "calib_01.csv", 10)
    assert found.pixels.shape == (300, 10, 2)
    assert not np.any(np.isnan(found.pixels))
    np.testing.assert_array_equal(found.pixels[0, 1], [1250.62072, 1401.27140])
