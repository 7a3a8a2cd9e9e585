"""Poses as trackers and other programs write them."""

from collections.abc import Callable, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lightpen.errors import FileError
from lightpen.formats.observation_files import read_poses

N_POSES = 12
RNG = np.random.default_rng(5)
ROTATIONS = Rotation.from_rotvec(0.3 * RNG.standard_normal((N_POSES, 3)))
PIVOT, TIP = np.array([60.0, -80.0, -1400.0]), np.array([-18.2, 3.1, -151.4])
MOVED = PIVOT - ROTATIONS.apply(TIP)
QUATERNIONS = ROTATIONS.as_quat()  # x y z w
LOST = 4  # index of the pose that is lost in some files


def rows(*columns: object) -> list[str]:
    """Join columns of N numbers or texts to lines."""
    cells = [
        np.asarray(each).reshape(N_POSES, -1).astype(str).tolist() for each in columns
    ]
    return ["\t".join(chain.from_iterable(row)) for row in zip(*cells, strict=True)]


def ndi(states: list[str]) -> list[str]:
    scalar_first = np.roll(QUATERNIONS, 1, axis=1)
    numbers = np.hstack([scalar_first, MOVED])
    for i, state in enumerate(states):
        numbers[i] = -3.69731e28 if state == "Missing" else numbers[i]
    ports = ["Port 1: NDI 8700000"] * N_POSES
    header = (
        "Tools\tPort 1\tFrame\tState\tQ0\tQx\tQy\tQz\tTx\tTy\tTz\tState\tTx\tTy\tTz"
    )
    frames, markers = np.arange(N_POSES), np.tile(["OK", "1", "2", "3"], (N_POSES, 1))
    ones = np.ones(N_POSES, dtype=int)
    return [header, *rows(ones, ports, frames, states, numbers, markers)]


def of_ndi_sample() -> list[str]:
    """Return lines with the header in a comment, and more markers than it names."""
    header = "#Tools,ToolInfo,Frame#,Status,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,Markers"
    poses = np.hstack([np.roll(QUATERNIONS, 1, axis=1), MOVED])
    around = ["1,870 s/n:3A"] * N_POSES, np.arange(N_POSES), ["OK"] * N_POSES
    lines = rows(*around, poses, ["0.1,1,OK,1,2,3"] * N_POSES)
    return [header, *(line.replace("\t", ",") for line in lines)]


def names_with_commas() -> list[str]:
    numbers = rows(np.arange(N_POSES), MOVED, QUATERNIONS)
    return ["ID,TX,TY,TZ,QX,QY,QZ,QW", *(line.replace("\t", " ") for line in numbers)]


def scalar_last() -> list[str]:
    header = "time\tqx\tqy\tqz\tqw\ttx_mm\tty_mm\ttz_mm"
    return [header, *rows(np.arange(N_POSES), QUATERNIONS, MOVED)]


def of_zed() -> list[str]:
    header = "timestamp\ttx\tty\ttz\tox\toy\toz\tow"
    return [header, *rows(np.arange(N_POSES), MOVED, QUATERNIONS)]


def in_chinese() -> list[str]:
    header = "帧\t四元数x\t四元数y\t四元数z\t四元数w\t平移x(mm)\t平移y(mm)\t平移z(mm)"
    return [header, *rows(np.arange(N_POSES), QUATERNIONS, MOVED)]


def in_german() -> list[str]:
    places = "X-Position\tY-Position\tZ-Position"
    header = f"Zeit\tQuat x\tQuat y\tQuat z\tQuat w\t{places}"
    units = "s" + 5 * "\t" + "mm\tmm\tmm"
    return [header, units, *rows(np.arange(N_POSES), QUATERNIONS, MOVED)]


def scalar_first() -> list[str]:
    header = "time\tqw\tqx\tqy\tqz\ttx_mm\tty_mm\ttz_mm"
    quaternions = np.roll(QUATERNIONS, 1, axis=1)
    return [header, *rows(np.arange(N_POSES), quaternions, MOVED)]


def real_and_imaginary(last: bool) -> list[str]:
    names = ["qi", "qj", "qk", "qr"] if last else ["qr", "qi", "qj", "qk"]
    header = "\t".join(["t", "x", "y", "z", *names])
    quaternions = QUATERNIONS if last else np.roll(QUATERNIONS, 1, axis=1)
    return [header, *rows(np.arange(N_POSES), MOVED, quaternions)]


def tum() -> list[str]:
    lines = rows(np.arange(N_POSES) / 10, MOVED / 1000, QUATERNIONS)
    return [line.replace("\t", " ") for line in lines]


def matrices() -> list[str]:
    whole = np.tile(np.eye(4), (N_POSES, 1, 1))
    whole[:, :3, :3], whole[:, :3, 3] = ROTATIONS.as_matrix(), MOVED
    return [line.replace("\t", ",") for line in rows(whole.reshape(N_POSES, 16))]


def matrices_by_columns() -> list[str]:
    whole = np.tile(np.eye(4), (N_POSES, 1, 1))
    whole[:, :3, :3], whole[:, :3, 3] = ROTATIONS.as_matrix(), MOVED
    names = "\t".join(f"M[{i},{j}]" for i in range(4) for j in range(4))
    return [names, *rows(np.swapaxes(whole, 1, 2).reshape(N_POSES, 16))]


def of_euroc() -> list[str]:
    places = "\t".join(f" p_RS_R_{axis} [m]" for axis in "xyz")
    turns = "\t".join(f" q_RS_{axis} []" for axis in "wxyz")
    header = f"#timestamp\t{places}\t{turns}\t v_RS_R_x [m s^-1]"
    quaternions, still = np.roll(QUATERNIONS, 1, axis=1), np.zeros(N_POSES)
    return [header, *rows(np.arange(N_POSES), MOVED / 1e3, quaternions, still)]


def of_vive() -> list[str]:
    header = "time\tx\ty\tz\tr_x\tr_y\tr_z\tr_w"
    return [header, *rows(np.arange(N_POSES), MOVED, QUATERNIONS)]


def vectors(axes: Sequence[str] = "xyz") -> list[str]:
    header = "\t".join(["frame", *(f"{v}vec_{axis}" for v in "rt" for axis in axes)])
    return [header, *rows(np.arange(N_POSES), ROTATIONS.as_rotvec(), MOVED)]


def named_by_tool() -> list[str]:
    header = "frame\tpen_X\tpen_Y\tpen_Z\tpen_Qx\tpen_Qy\tpen_Qz\tpen_Qw"
    return [header, *rows(np.arange(N_POSES), MOVED, QUATERNIONS)]


@pytest.mark.parametrize(
    "lines",
    [
        *(
            of_zed,
            of_ndi_sample,
            names_with_commas,
            in_german,
            in_chinese,
            scalar_last,
            scalar_first,
            tum,
            matrices,
            matrices_by_columns,
            vectors,
            of_euroc,
            of_vive,
            named_by_tool,
        ),
        lambda: real_and_imaginary(last=False),
        lambda: real_and_imaginary(last=True),
        lambda: vectors("012"),
        lambda: vectors("123"),
        lambda: ndi(["OK"] * N_POSES),
    ],
)
def test_poses_of_other_programs_are_read_in_their_conventions(
    tmp_path: Path, lines: Callable[[], list[str]]
) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("\n".join(lines()) + "\n")

    found = read_poses(path)

    np.testing.assert_allclose(found.rotations, ROTATIONS.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(found.translations, MOVED, atol=1e-9)
    assert found.n_lost == 0


def test_few_rows_that_fit_another_order_by_chance_do_not_decide(
    tmp_path: Path,
) -> None:
    rng = np.random.default_rng(2)
    quaternions = Rotation.random(60, random_state=3).as_quat()
    places = rng.normal(0, 3.0, (60, 3))
    places[:5] *= np.sqrt(1 - quaternions[:5, :1] ** 2) / np.linalg.norm(
        places[:5], axis=1, keepdims=True
    )  # with the first number of the quaternion of length 1
    path = tmp_path / "tum.txt"
    np.savetxt(path, np.column_stack([np.arange(60), places, quaternions]))

    found = read_poses(path)

    assert found.n_lost == 0
    np.testing.assert_allclose(found.translations, 1000 * places)


@pytest.mark.parametrize(
    ("unit", "size"),
    [
        (" [cm]", 10.0),
        (" [m]", 1000.0),
        (" [in]", 25.4),
        (" [um]", 1e-3),
        (" in mm", 1.0),
    ],
)
def test_the_unit_of_translations_is_that_of_their_names(
    tmp_path: Path, unit: str, size: float
) -> None:
    names = ["qx", "qy", "qz", "qw", *(f"t{axis}{unit}" for axis in "xyz")]
    path = tmp_path / "poses.tsv"
    lines = ["\t".join(names), *rows(QUATERNIONS, MOVED / size)]
    path.write_text("\n".join(lines) + "\n")

    np.testing.assert_allclose(read_poses(path).translations, MOVED, rtol=1e-9)


def test_units_may_stand_in_a_row_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "poses.tsv"
    header = ["qx\tqy\tqz\tqw\ttx\tty\ttz", "-\t-\t-\t-\tcm\tcm\tcm"]
    path.write_text("\n".join([*header, *rows(QUATERNIONS, MOVED / 10), ""]))

    np.testing.assert_allclose(read_poses(path).translations, MOVED, rtol=1e-9)


def test_translations_in_an_unknown_unit_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("tx [ft],ty [ft],tz [ft],qw,qx,qy,qz\n1,2,3,1,0,0,0\n")
    with pytest.raises(FileError, match="ft, which is no known unit"):
        read_poses(path)


@pytest.mark.parametrize("name", ["tag_id", "id", "child_frame_id"])
def test_the_pen_is_chosen_among_tags(tmp_path: Path, name: str) -> None:
    path = tmp_path / "tags.tsv"
    header = f"frame_id\t{name}\ttx_mm\tty_mm\ttz_mm\tqx\tqy\tqz\tqw"
    pen = rows(np.arange(N_POSES), [7] * N_POSES, MOVED, QUATERNIONS)
    still = rows(np.arange(N_POSES), [3] * N_POSES, MOVED * 0 + 9, QUATERNIONS)
    path.write_text("\n".join([header, *chain(*zip(still, pen, strict=True)), ""]))

    with pytest.raises(FileError, match="2 tools: 3, 7"):
        read_poses(path)
    np.testing.assert_allclose(read_poses(path, "7").translations, MOVED)


def test_lost_frames_of_a_tracker_are_left_out_and_counted(tmp_path: Path) -> None:
    states = ["OK"] * N_POSES
    states[LOST] = "Missing"
    path = tmp_path / "track.tsv"
    path.write_text("\n".join(ndi(states)) + "\n")

    found = read_poses(path)

    kept = np.delete(np.arange(N_POSES), LOST)
    np.testing.assert_allclose(found.translations, MOVED[kept])
    assert (found.places.tolist(), found.n_lost) == ((kept + 1).tolist(), 1)


@pytest.mark.parametrize(
    ("name", "states"),
    [
        ("tool is visible", "012"),
        ("tracking_ok", ["False", "True", "True"]),
        ("Gültig", ["nein", "ja", "ja"]),
        ("状态", ["丢失", "正常", "正常"]),
    ],
)
def test_a_pose_that_a_flag_calls_invalid_is_left_out(
    tmp_path: Path, name: str, states: Sequence[str]
) -> None:
    path = tmp_path / "poses.csv"
    rows = [f"{states[i % 3]},1,0,0,0,{i + 1},2,900" for i in range(6)]
    path.write_text("\n".join([f"{name},qw,qx,qy,qz,tx,ty,tz", *rows, ""]), "utf-8")

    assert read_poses(path).places.tolist() == [2, 3, 5, 6]


@pytest.mark.parametrize(
    ("data", "named"),
    [
        (b'[{"position": [1, 2, 3], "rotation": [0, 0, 0, 1]}]', "JSON"),
        (b"[[ 1.  0.]\n [ 0.  1.]]\n", "numpy"),
        (b"\x93NUMPY\x01\x00v\x00{'descr': '<f8'}" + bytes(80), "numpy"),
        (b"0 0 1\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n", "Open3D"),
        (b"fr 21753\nts 39596.02\n6dcal 1\n6d 0\n", "DTrack"),
        (b"#ROSBAG V2.0\n", "ROS bag"),
        (b"\x02\x50" + bytes(500), "C3D"),
        (b"NO_OF_FRAMES\t80\nNO_OF_BODIES\t1\n", "Qualisys"),
        (b"header:\n  seq: 1\npose:\n  position:\n    x: 1\n", "ROS"),
        (b"At time 159.1\n- Translation: [1, 2, 3]\n", "tf_echo"),
        (b"0.0 INFO LOG a\n0.1 T20 POSE 1 2 3 1 0 0 0\n", "libsurvive"),
        (b"01 01+08499+00123-00044+00022+012345-004567-140000+00012\n", "NDI"),
        (b"poses:\n  - x: 1\n    y: 2\n", "YAML"),
        (b"Pose 1\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n", "matrices"),
        (b"1716304712,0,map,0.1,0.2,0.3,0,0,0,1\n", "ROS 2"),
        (b"6, 12, empivot.txt\n  1.0,  2.0,  3.0\n", "CIS"),
        (b"Format Version,1.23\n\n,Type,Marker\nFrame,Time,X\n", "Motive"),
        (b"HIERARCHY\nROOT pen\n", "BVH"),
        (b"p[0.143, -0.2, 1.5, 0.1, 0.2, 0.3]\n", "Universal Robots"),
        (b"Objects\n100\n,,Pen\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n", "Vicon"),
    ],
)
def test_poses_in_a_form_that_is_not_read_are_named(
    tmp_path: Path, data: bytes, named: str
) -> None:
    path = tmp_path / "poses.file"
    path.write_bytes(data)

    with pytest.raises(FileError, match=f"{named}.*qw,qx,qy,qz"):
        read_poses(path)


@pytest.mark.parametrize(
    "angles",
    [
        *("rx,ry,rz", "roll,pitch,yaw", "roll_deg,pitch_deg,yaw_deg", "a,b,c"),
        *("Pen Rz,Pen Ry,Pen Rx", "omega,phi,kappa"),
    ],
)
def test_angles_are_refused_by_name(tmp_path: Path, angles: str) -> None:
    path = tmp_path / "poses.csv"
    path.write_text(f"{angles},tx_mm,ty_mm,tz_mm\n1,2,3,4,5,6\n")

    with pytest.raises(FileError, match=r"quaternions or matrices; name .* rvec_x"):
        read_poses(path)


def test_four_numbered_components_are_no_known_quaternion(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("q1,q2,q3,q4,x,y,z\n0,0,0,1,4,5,6\n")

    with pytest.raises(FileError, match="no columns of poses that are known"):
        read_poses(path)


def plus(sign: str, end: str) -> bytes:
    """Return a sequence of PLUS: a pen, a reference that stands, a lost frame."""
    lines = ["ObjectType = Image", "NDims = 3", "DimSize = 2 2 12"]
    if sign == ":=":
        lines = ["NRRD0004", "type: unsigned char", "sizes: 2 2 12"]
    for i in range(N_POSES):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = ROTATIONS[i].as_matrix(), MOVED[i]
        for name, matrix in (("Pen", pose), ("Reference", np.eye(4))):
            numbers = " ".join(map(repr, matrix.ravel().tolist()))
            status = "INVALID" if i == LOST and name == "Pen" else "OK"
            lines.append(f"Seq_Frame{i:04}_{name}ToTrackerTransform {sign} {numbers}")
            lines.append(
                f"Seq_Frame{i:04}_{name}ToTrackerTransformStatus {sign} {status}"
            )
        lines.append(f"Seq_Frame{i:04}_Timestamp {sign} {i / 20}")
    return "\n".join([*lines, end, ""]).encode() + bytes(range(128, 176))


@pytest.mark.parametrize(
    ("name", "sign", "end"),
    [
        ("tracked.igs.mha", "=", "ElementDataFile = LOCAL"),
        ("tracked.igs.nrrd", ":=", ""),
    ],
)
def test_a_sequence_of_plus_is_read(
    tmp_path: Path, name: str, sign: str, end: str
) -> None:
    path = tmp_path / name
    path.write_bytes(plus(sign, end))

    found = read_poses(path)

    kept = np.delete(np.arange(N_POSES), LOST)
    np.testing.assert_allclose(found.rotations, ROTATIONS.as_matrix()[kept], atol=1e-12)
    np.testing.assert_allclose(found.translations, MOVED[kept], atol=1e-12)
    assert (found.places.tolist(), found.n_lost) == ((kept + 1).tolist(), 1)


def test_a_sequence_without_moving_transforms_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "tracked.mha"
    text = plus("=", "ElementDataFile = LOCAL").replace(b"Transform", b"Matrix")
    path.write_bytes(text)

    with pytest.raises(FileError, match=r"tracked\.mha"):
        read_poses(path)


def motive(bodies: list[str], *, is_labelled: bool, unit: str = "Meters") -> str:
    """Return a recording of Motive, each body followed by a marker of it."""
    kinds = ["Rotation"] * 4 + ["Position"] * 3 + ["Mean Marker Error"]
    columns = [("Rigid Body", body, kind) for body in bodies for kind in kinds]
    axes = [*"XYZWXYZ", ""] * len(bodies)
    markers = [("Rigid Body Marker", f"{body}:1", "Position") for body in bodies]
    columns += [marker for marker in markers for _ in "XYZ"]
    axes += list("XYZ") * len(bodies)
    heads = [["", label if is_labelled else ""] for label in ("Type", "Name", "ID", "")]
    heads[0] += [kind for kind, _, _ in columns]
    heads[1] += [name for _, name, _ in columns]
    heads[2] += ["ABC"] * len(columns)
    heads[3] += [what for _, _, what in columns]
    size = {"Meters": 1000.0, "Millimeters": 1.0}[unit]
    lines = [
        "Format Version,1.23,Take Name,a,Rotation Type,Quaternion,Length Units,"
        f"{unit},Coordinate Space,Global",
        "",
        *(",".join(head) for head in heads),
        ",".join(["Frame", "Time (Seconds)", *axes]),
    ]
    for i in range(N_POSES):
        own = [*QUATERNIONS[i], *(MOVED[i] / size), 0.0002]
        other = [0, 0, 0, 1, *((MOVED[i] + 500) / size), 0.0002]
        cells = [[str(each) for each in (own, other)[b]] for b in range(len(bodies))]
        if i == LOST:
            cells[0] = [""] * 8
        flat = [cell for body in cells for cell in body] + ["0.1"] * 3 * len(bodies)
        lines.append(",".join([str(i), str(i / 120), *flat]))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("is_labelled", [False, True])
@pytest.mark.parametrize("unit", ["Meters", "Millimeters"])
@pytest.mark.parametrize("bodies", [["Rigid Body 1"], ["Pen", "Table"]])
def test_a_recording_of_motive_is_read(
    tmp_path: Path, bodies: list[str], unit: str, *, is_labelled: bool
) -> None:
    path = tmp_path / "take.csv"
    path.write_text(motive(bodies, is_labelled=is_labelled, unit=unit))

    found = read_poses(path, "pen" if len(bodies) > 1 else None)

    kept = np.delete(np.arange(N_POSES), LOST)
    np.testing.assert_allclose(found.rotations, ROTATIONS.as_matrix()[kept], atol=1e-9)
    np.testing.assert_allclose(found.translations, MOVED[kept], rtol=1e-12)
    assert found.n_lost == 1
    if len(bodies) > 1:
        with pytest.raises(FileError, match=r"(?i)pen.*table"):
            read_poses(path)


def test_euler_angles_of_motive_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "take.csv"
    text = motive(["Pen"], is_labelled=True).replace("Type,Quaternion", "Type,XYZ")
    path.write_text(text)

    with pytest.raises(FileError, match="quaternions"):
        read_poses(path)


def test_words_without_names_of_columns_need_names(tmp_path: Path) -> None:
    path = tmp_path / "printed.csv"
    path.write_text("1,Port:10,OK,1,0,0,0,5,6,7\n2,Port:10,OK,1,0,0,0,5,6,8\n")

    with pytest.raises(FileError, match=r"no header and 10 columns.* header line on"):
        read_poses(path)
