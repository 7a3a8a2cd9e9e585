"""The licences and the list of parts that go with the installer."""

import json
from pathlib import Path

from installer.licences import Part, licence_text, parts_of, unlicensed
from installer.sbom import BundledPart, bill_of_materials

PYTHON = Part("CPython", "3.13.2", "PSF-2.0", ())
NUMPY = BundledPart(
    name="numpy",
    version="2.5.5",
    file="numpy-2.5.5-cp313-cp313-win_amd64.whl",
    sha256="ab" * 32,
    purl="pkg:pypi/numpy@2.5.5",
    licence="BSD-3-Clause",
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

    assert part.licence == "BSD License"


def test_the_list_of_parts_names_each_with_its_digest() -> None:
    bill = json.loads(bill_of_materials("0.1.0", [NUMPY], 0))

    assert bill["bomFormat"] == "CycloneDX"
    (entry,) = bill["components"]
    assert entry["purl"] == NUMPY.purl
    assert entry["hashes"] == [{"alg": "SHA-256", "content": NUMPY.sha256}]
    assert bill["dependencies"] == [{"ref": "lightpen", "dependsOn": [NUMPY.purl]}]


def test_the_same_parts_give_the_same_list_and_others_another() -> None:
    first, again = (bill_of_materials("0.1.0", [NUMPY], 0) for _ in range(2))

    assert first == again
    assert first != bill_of_materials("0.1.0", [], 0)
