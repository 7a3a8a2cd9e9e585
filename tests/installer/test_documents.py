"""The licences and the list of parts that go with the installer."""

import json
import struct
from pathlib import Path

import pytest
from installer.binaries import FIXED_VERSION
from installer.libraries import LIBRARIES, find_libraries
from installer.licences import Part, licence_text, parts_of, unlicensed
from installer.pruning import is_kept
from installer.sbom import BundledPart, bill_of_materials, cpe

PYTHON = Part("CPython", "3.13.2", "PSF-2.0", "Python Software Foundation", ())
NUMPY = BundledPart(
    name="numpy",
    version="2.5.5",
    file="numpy-2.5.5-cp313-cp313-win_amd64.whl",
    sha256="ab" * 32,
    purl="pkg:pypi/numpy@2.5.5",
    licence="BSD-3-Clause",
    supplier="NumPy Developers",
    cpe=cpe("numpy:numpy", "2.5.5"),
)


def distribution(packages: Path, name: str, licence: str) -> Path:
    folder = packages / f"{name}-1.0.dist-info"
    folder.mkdir()
    metadata = f"Name: {name}\nVersion: 1.0\nLicense-Expression: {licence}\n\nText"
    (folder / "METADATA").write_text(metadata, encoding="utf-8")
    return folder


def test_each_part_brings_the_text_of_its_licence(tmp_path: Path) -> None:
    folder = distribution(tmp_path, "qt", "LGPL-3.0-only")
    (folder / "licenses").mkdir()
    (folder / "licenses" / "LICENCE.LGPL").write_text("GNU LESSER\r\n", newline="")

    parts = parts_of(tmp_path, PYTHON)
    text = licence_text(parts)

    assert [part.name for part in parts] == ["CPython", "qt"]
    assert "qt 1.0: LGPL-3.0-only" in text
    assert "GNU LESSER\n" in text


def test_a_part_without_a_licence_is_noticed(tmp_path: Path) -> None:
    distribution(tmp_path, "nameless", "MIT")

    assert unlicensed(parts_of(tmp_path, PYTHON)) == ["CPython", "nameless"]


def test_a_licence_can_be_stated_by_a_classifier_alone(tmp_path: Path) -> None:
    classifier = "Classifier: License :: OSI Approved :: BSD License"
    metadata = distribution(tmp_path, "colour", "") / "METADATA"
    metadata.write_text(f"Name: colour\nVersion: 1.0\n{classifier}\n\nText", "utf-8")

    (_, part) = parts_of(tmp_path, PYTHON)

    assert part.licence == "BSD-3-Clause"


def test_the_list_of_parts_names_each_with_its_digest() -> None:
    bill = json.loads(bill_of_materials("0.1.0", [NUMPY], 0))

    assert bill["bomFormat"] == "CycloneDX"
    (entry,) = bill["components"]
    assert entry["purl"] == NUMPY.purl
    assert entry["hashes"] == [{"alg": "SHA-256", "content": NUMPY.sha256}]
    assert entry["licenses"] == [{"expression": "BSD-3-Clause"}]
    assert entry["supplier"] == {"name": "NumPy Developers"}
    assert entry["cpe"] == "cpe:2.3:a:numpy:numpy:2.5.5:*:*:*:*:*:*:*"
    refs = [entry["bom-ref"]]
    assert bill["dependencies"] == [{"ref": "lightpen", "dependsOn": refs}]


def test_the_same_parts_give_the_same_list_and_others_another() -> None:
    first, again = (bill_of_materials("0.1.0", [NUMPY], 0) for _ in range(2))

    assert first == again
    assert first != bill_of_materials("0.1.0", [], 0)


def test_a_licence_that_spdx_does_not_know_is_not_made_up(tmp_path: Path) -> None:
    distribution(tmp_path, "odd", "As you like")

    (_, part) = parts_of(tmp_path, PYTHON)

    assert part.licence == "NOASSERTION"


def test_qt_brings_attributions_and_the_lgpl_but_no_commercial_licence(
    tmp_path: Path,
) -> None:
    distribution(tmp_path, "PySide6_Essentials", "LGPL-3.0-only")

    text = licence_text(parts_of(tmp_path, PYTHON))

    assert "src/3rdparty/harfbuzz-ng" in text
    assert "GNU LESSER GENERAL PUBLIC LICENSE" in text
    assert "Source of the LGPL parts" in text
    assert not is_kept("pyside6.dist-info/licenses/LicenseRef-Qt-Commercial.txt")


def write_libraries(folder: Path) -> None:
    resources = FIXED_VERSION + struct.pack("<3I", 0, 1 << 16 | 2, 3 << 16)
    for each in LIBRARIES:
        path = folder / each.pattern.replace("*", "-1")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"OpenSSL 3.6.5 expat_2.6.4" + resources)
        if each.stated_in:
            (folder / each.stated_in).parent.mkdir(exist_ok=True)
            (folder / each.stated_in).write_text('"version": "0.3.34.237"')


def test_the_versions_of_libraries_are_read_from_their_files(tmp_path: Path) -> None:
    write_libraries(tmp_path)

    found = {(each.library.name, each.version) for each in find_libraries(tmp_path)}

    assert found == {
        ("OpenSSL", "3.6.5"),
        ("SQLite", "1.2.3"),
        ("Expat", "2.6.4"),
        ("Qt", "1.2.3"),
        ("OpenBLAS", "0.3.34"),
        ("libpq", "1.3"),
        ("Microsoft Visual C++ runtime", "1.2.3"),
    }


def test_a_library_that_is_not_where_it_was_or_states_no_version_is_noticed(
    tmp_path: Path,
) -> None:
    write_libraries(tmp_path)
    (tmp_path / "runtime" / "sqlite3.dll").write_bytes(b"")
    with pytest.raises(LookupError, match="states no version of SQLite"):
        list(find_libraries(tmp_path))

    (tmp_path / "runtime" / "sqlite3.dll").unlink()
    with pytest.raises(LookupError, match="holds SQLite"):
        list(find_libraries(tmp_path))
