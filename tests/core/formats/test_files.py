"""Tests of reading files whole and writing them whole or not at all."""

import errno
import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from threading import Timer

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpen.errors import FileError
from lightpen.formats.camera_files import CAMERA_FILE
from lightpen.formats.files import (
    create_whole,
    kind_of,
    quoted,
    read_bytes,
    read_text,
    sha256,
    write_whole,
)
from lightpen.formats.part_files import locked, unlock
from lightpen.formats.pen_files import PEN_FILE
from lightpen.messages import printable

LIMIT = 1000

posix_only = pytest.mark.skipif(os.name != "posix", reason="needs POSIX limits")


def file(folder: Path, data: bytes, name: str = "cam.yaml") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def names_in(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()]


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """Return a folder where everyone may write; those of pytest are private."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o777)
        yield folder


def test_a_file_is_read_whole(tmp_path: Path) -> None:
    data = bytes(range(256))
    assert read_bytes(file(tmp_path, data), CAMERA_FILE, 256) == data


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"The intrinsics file .*none\.yaml does not"):
        read_bytes(tmp_path / "none.yaml", CAMERA_FILE, LIMIT)


def test_a_file_in_place_of_a_folder_is_refused(tmp_path: Path) -> None:
    path = file(tmp_path, b"x")
    with pytest.raises(FileError, match="does not exist"):
        read_bytes(path / "cam.yaml", CAMERA_FILE, LIMIT)


def test_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="is a folder"):
        read_bytes(tmp_path, CAMERA_FILE, LIMIT)


def test_an_empty_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="is empty"):
        read_bytes(file(tmp_path, b""), CAMERA_FILE, LIMIT)


def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.yaml"
    with path.open("wb") as stream:
        stream.truncate(10**12)  # sparse: a terabyte to whoever tries to read it
    with pytest.raises(FileError, match=r"1000000\.0 MB; the maximum is 0\.001 MB"):
        read_bytes(path, CAMERA_FILE, LIMIT)


def test_a_name_too_long_for_the_disk_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"cannot be read|does not exist"):
        read_bytes(tmp_path / ("n" * 5000), CAMERA_FILE, LIMIT)


@posix_only
def test_a_pipe_is_refused_without_waiting_for_it(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(FileError, match="pipe or a device"):
        read_bytes(path, CAMERA_FILE, LIMIT)


@posix_only
def test_a_file_of_somebody_else_is_refused(open_folder: Path) -> None:
    path = file(open_folder, b"secret")
    path.chmod(0)
    result = as_nobody(f"read_bytes(Path({str(path)!r}), CAMERA_FILE, 99)")
    assert "cannot be read: Permission denied" in result


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le with mark", "cp1252"]
)
def test_text_is_read_in_the_encodings_of_instruments(
    tmp_path: Path, encoding: str
) -> None:
    text = "# gemessen für µm\n1,2\n"
    data = (
        b"\xff\xfe" + text.encode("utf-16-le")
        if encoding.endswith("mark")
        else text.encode(encoding)
    )
    assert read_text(file(tmp_path, data), PEN_FILE, LIMIT) == text


def test_line_ends_of_every_system_are_one(tmp_path: Path) -> None:
    path = file(tmp_path, b"a\r\nb\rc\n")
    assert read_text(path, PEN_FILE, LIMIT) == "a\nb\nc\n"


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"led,x\n1,\x002", "line 2 contains the control character 0"),
        ("1,2".encode("utf-16-le"), "line 1 contains the control character 0"),
        (b"\x89PNG\r\n\x1a\n", "a file of the kind image, which is not read"),
        (b"#ROSBAG V2.0\n", "a file of the kind ROS bag"),
        (b"PAR1\x15\x04", "a file of the kind Parquet"),
        (b"ARROW1\0\0", "a file of the kind Arrow"),
        (b"ISO-10303-21;\nHEADER;", "a file of the kind STEP"),
        (b"\xef\xbb\xbf<!DOCTYPE html>\n<html>", "HTML"),
        (b"\x81\x20", "byte 1 matches no known encoding"),
        (b"\xff\xfe1", "matches no known encoding."),
        (b" \n\t\n", "contains only blanks."),
        (b"\xef\xbb\xbf", "contains only blanks."),
    ],
)
def test_what_is_not_text_is_refused(tmp_path: Path, data: bytes, what: str) -> None:
    with pytest.raises(FileError, match=what):
        read_text(file(tmp_path, data), PEN_FILE, LIMIT)


@given(st.binary(max_size=200))
def test_any_bytes_are_text_or_are_refused(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = file(tmp_path_factory.mktemp("any"), data)
    try:
        text = read_text(path, PEN_FILE, LIMIT)
    except FileError:
        return
    assert "\r" not in text
    assert text.encode()


def test_writing_replaces_the_old_file(tmp_path: Path) -> None:
    path = file(tmp_path, b"old")
    write_whole(path, b"new")
    assert path.read_bytes() == b"new"
    assert names_in(tmp_path) == ["cam.yaml"]


def test_a_file_that_somebody_reads_for_a_moment_is_replaced(tmp_path: Path) -> None:
    path = file(tmp_path, b"old")
    reader = path.open("rb")
    Timer(0.2, reader.close).start()
    write_whole(path, b"new")
    assert path.read_bytes() == b"new"


@posix_only
def test_a_new_file_has_the_usual_permissions(tmp_path: Path) -> None:
    plain = file(tmp_path, b"plain", "plain")
    write_whole(tmp_path / "new", b"new")
    assert (tmp_path / "new").stat().st_mode == plain.stat().st_mode


@posix_only
def test_an_old_file_keeps_its_permissions(tmp_path: Path) -> None:
    path = file(tmp_path, b"old")
    path.chmod(0o640)
    write_whole(path, b"new")
    assert path.stat().st_mode & 0o777 == 0o640


@posix_only
def test_writing_through_a_link_keeps_the_link(tmp_path: Path) -> None:
    target = file(tmp_path, b"old", "target")
    link = tmp_path / "link"
    link.symlink_to(target)
    write_whole(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


@posix_only
@posix_only
def test_a_link_to_itself_is_not_written_over(tmp_path: Path) -> None:
    loop = tmp_path / "loop"
    loop.symlink_to(loop)

    with pytest.raises(FileError, match="leads back to itself"):
        write_whole(loop, b"new")
    assert loop.is_symlink()


def test_a_device_is_written_to_and_not_replaced() -> None:
    write_whole(Path(os.devnull), b"new")
    assert Path(os.devnull).is_char_device()


def test_a_missing_folder_is_named_as_the_reason(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="Its folder does not exist"):
        write_whole(tmp_path / "none" / "cam.yaml", b"new")


def test_a_folder_is_not_written_over(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="it is a folder"):
        write_whole(tmp_path, b"new")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_device_is_named_as_the_reason() -> None:
    with pytest.raises(FileError, match="The disk is full"):
        write_whole(Path("/dev/full"), b"new")


@posix_only
def test_a_full_disk_leaves_the_old_file_whole(tmp_path: Path) -> None:
    """A file size limit stops the write halfway, as a full disk does."""
    path = file(tmp_path, b"old")
    result = in_other_process(
        "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))",
        f"write_whole(Path({str(path)!r}), bytes(10_000))",
    )
    assert "The file would be larger than allowed" in result
    assert "The previous content is unchanged" in result
    assert path.read_bytes() == b"old"
    assert names_in(tmp_path) == ["cam.yaml"]


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="mounting needs root"
)
def test_a_full_file_system_leaves_the_old_file_whole(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)],
        capture_output=True,
        check=False,
    )
    if mounted.returncode:
        pytest.skip("this system does not allow mounting")
    try:
        path = file(disk, b"old")
        with pytest.raises(FileError, match=r"The disk is full\. Free some space"):
            write_whole(path, bytes(200_000))
        assert path.read_bytes() == b"old"
        assert names_in(disk) == ["cam.yaml"]
    finally:
        subprocess.run(["umount", str(disk)], check=True)


@posix_only
def test_a_write_protected_file_is_not_replaced(open_folder: Path) -> None:
    path = file(open_folder, b"old")
    path.chmod(0o444)
    result = as_nobody(f"write_whole(Path({str(path)!r}), b'new')")
    assert "Permission is denied" in result
    assert path.read_bytes() == b"old"


@posix_only
def test_a_file_open_to_all_is_replaced_by_anyone(open_folder: Path) -> None:
    path = file(open_folder, b"old")
    path.chmod(0o666)
    assert as_nobody(f"write_whole(Path({str(path)!r}), b'new')") == ""
    assert path.read_bytes() == b"new"


def test_an_unforeseen_reason_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(descriptor: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(os, "fsync", fail)
    path = file(tmp_path, b"old")
    with pytest.raises(FileError, match=os.strerror(errno.EIO)):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert names_in(tmp_path) == ["cam.yaml"]


def test_a_new_file_is_created_whole(tmp_path: Path) -> None:
    create_whole(tmp_path / "new.json", b"new")

    assert (tmp_path / "new.json").read_bytes() == b"new"
    assert names_in(tmp_path) == ["new.json"]


def test_a_file_that_exists_is_not_created_again(tmp_path: Path) -> None:
    path = file(tmp_path, b"old")
    with pytest.raises(FileError, match="There is a file of that name already"):
        create_whole(path, b"new")

    assert path.read_bytes() == b"old"
    assert names_in(tmp_path) == ["cam.yaml"]


def test_a_disk_that_knows_no_links_gets_new_files_only_as_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path, target: Path) -> None:
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(Path, "hardlink_to", refuse)  # FAT answers so
    create_whole(tmp_path / "cam.yaml", b"old")
    with pytest.raises(FileError, match="There is a file of that name already"):
        create_whole(tmp_path / "cam.yaml", b"new")

    assert (tmp_path / "cam.yaml").read_bytes() == b"old"
    assert names_in(tmp_path) == ["cam.yaml"]


@posix_only
def test_a_new_file_whose_name_is_not_on_the_disk_is_taken_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sync = os.fsync

    def fail_for_folders(descriptor: int) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", fail_for_folders)
    with pytest.raises(FileError, match=os.strerror(errno.EIO)):
        create_whole(tmp_path / "new.json", b"new")

    assert names_in(tmp_path) == []


@posix_only
def test_a_new_file_on_a_full_disk_is_none(tmp_path: Path) -> None:
    path = tmp_path / "new.json"
    result = in_other_process(
        "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))",
        f"create_whole(Path({str(path)!r}), bytes(10_000))",
    )
    assert "The file would be larger than allowed" in result
    assert names_in(tmp_path) == []


def test_a_lock_leaves_a_file_where_its_writer_was(tmp_path: Path) -> None:
    path = tmp_path / "locked"
    with path.open("wb") as stream:
        assert locked(stream.fileno())
        stream.write(b"first ")
        stream.flush()
        unlock(stream.fileno())
        stream.write(b"second")

    assert path.read_bytes() == b"first second"


def test_the_digest_is_that_of_the_content(tmp_path: Path) -> None:
    digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert sha256(file(tmp_path, b"abc")) == digest  # FIPS 180-2, example B.1


def test_the_digest_of_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="cannot be read"):
        sha256(tmp_path / "none")


@given(st.text())
def test_what_is_shown_can_be_printed_anywhere(text: str) -> None:
    assert printable(text).isprintable()
    assert len(quoted(text)) < 500


def test_a_long_excerpt_is_cut() -> None:
    assert quoted("a" * 100) == f'"{"a" * 40}..."'


def in_other_process(preparation: str, call: str) -> str:
    """Return the text of the FileError of a call in another process."""
    program = (
        "import os\n"
        "from pathlib import Path\n"
        "from lightpen.errors import FileError\n"
        "from lightpen.formats.camera_files import CAMERA_FILE\n"
        "from lightpen.formats.files import create_whole, read_bytes, write_whole\n"
        f"{preparation}\n"
        f"try:\n    {call}\nexcept FileError as error:\n    print(error)\n"
    )
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout


def as_nobody(call: str) -> str:
    """Return the text of the FileError of a call without the rights of root."""
    return in_other_process("os.setuid(65534)" if os.geteuid() == 0 else "", call)


@pytest.mark.parametrize("name", ["camera\0.yaml", "camera\ud800.yaml"])
def test_a_name_that_no_file_can_have_is_refused(name: str) -> None:
    """As a rig file may give it of a camera file."""
    with pytest.raises(FileError, match=r"not valid for files|does not exist"):
        read_text(Path(name), CAMERA_FILE, LIMIT)


def test_a_name_that_is_no_utf_8_tells_its_kind_all_the_same() -> None:
    assert kind_of(b"", "swing\udcff.JLS") == "JPEG-LS"
    assert kind_of(b"", "swing\udcff.csv") == ""
