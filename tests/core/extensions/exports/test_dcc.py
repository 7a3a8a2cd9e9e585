"""A record as a certificate of PTB is valid, and says what its JSON says."""

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import pytest
from msgspec import structs

from lightpen.formats.own_json import record_bytes
from lightpen.model.names import Laboratory
from lightpen.record.calibrations import CalibrationFile, TracedItem, read_calibration
from lightpen.record.library.tip_library import ItemKind, ListedCamera
from lightpen.record.swings.header import Names
from lightpen_extensions.exports.formats import (
    DCC,
    NO_CERTIFICATE,
    SI,
    VERSION,
    dcc_text,
)

if TYPE_CHECKING:
    from xmlschema import XMLSchema

SUBSET = Path(__file__).parents[3] / "data" / f"dcc-{VERSION}-subset.xsd"
# PTB's own, where somebody put it beside the image sets.
WHOLE = Path(os.environ.get("LIGHTPEN_DATA", "no such folder")) / "dcc" / "dcc.xsd"
LABORATORY = Laboratory("Hall 2", "hall2@example.com", "Berlin", "DE")
NAMES = {"dcc": DCC, "si": SI}


@pytest.fixture(scope="module")
def calibration_file(
    stated: Mapping[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> CalibrationFile:
    file = tmp_path_factory.mktemp("dcc") / "tip.json"
    file.write_bytes(record_bytes(stated))
    return read_calibration(file)


@pytest.fixture(scope="module", params=[SUBSET, WHOLE], ids=["subset", "whole"])
def schema(request: pytest.FixtureRequest) -> "XMLSchema":
    from xmlschema import XMLSchema  # takes long

    if not request.param.exists():
        pytest.skip("The schema of PTB is not there.")
    return XMLSchema(str(request.param))


def faults(schema: "XMLSchema", text: str) -> list[str]:
    return [str(error.reason) for error in schema.iter_errors(text)]


def test_it_is_as_the_schema_says(
    schema: "XMLSchema", calibration_file: CalibrationFile
) -> None:
    assert faults(schema, dcc_text(calibration_file, LABORATORY)) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('schemaVersion="3.2.1"', 'schemaVersion="2.4.0"'),
        ("<dcc:city>Berlin</dcc:city>", "<dcc:town>Berlin</dcc:town>"),
        ("<si:value>", "<si:value>about "),
        ("dcc:release>", "dcc:version>"),
    ],
)
def test_one_that_is_otherwise_is_refused(
    schema: "XMLSchema", calibration_file: CalibrationFile, old: str, new: str
) -> None:
    text = dcc_text(calibration_file, LABORATORY)
    assert old in text

    assert faults(schema, text.replace(old, new))


def test_it_states_place_persons_dates_conditions_and_certificates(
    schema: "XMLSchema", calibration_file: CalibrationFile
) -> None:
    camera = ListedCamera(
        id="CAM-7", certificate="K-17", certified=date(2026, 3, 1), due=date(2027, 3, 1)
    )
    calibration = calibration_file.calibration
    assumed = replace(
        calibration.assumptions, temperature_c=21.5, humidity_percent=45.0
    )
    file = replace(
        calibration_file,
        names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1"),
        supervisor="Eve",
        measured=calibration.created - timedelta(days=2),
        traced=(TracedItem(ItemKind.CAMERA, "CAM-7", camera),),
        calibration=structs.replace(calibration, assumptions=assumed),
    )
    laboratory = replace(
        LABORATORY,
        street="Seestr. 1",
        post_code="13353",
        procedure="WI 7.3",
        place="customer",
    )
    text = dcc_text(file, laboratory)

    assert faults(schema, text) == []
    root = ElementTree.fromstring(text)

    def texts(path: str) -> list[str]:
        return [each.text or "" for each in root.iterfind(f".//{path}", NAMES)]

    begin, end = texts("dcc:beginPerformanceDate"), texts("dcc:endPerformanceDate")
    assert date.fromisoformat(end[0]) - date.fromisoformat(begin[0]) == timedelta(2)
    assert texts("dcc:performanceLocation") == ["customer"]
    persons = "dcc:respPerson"
    assert texts(f"{persons}/dcc:person/dcc:name/dcc:content") == ["Ann", "Eve"]
    assert texts(f"{persons}/dcc:mainSigner") == ["false", "true"]
    assert texts("dcc:calibrationLaboratory//dcc:street") == ["Seestr. 1"]
    assert texts("dcc:influenceCondition//si:value") == ["21.5", "45.0"]
    assert "Certificate K-17 of 2026-03-01, due 2027-03-01." in text
    assert "WI 7.3" in text


def test_it_holds_tip_uncertainty_and_covariance_to_the_last_digit(
    stated: Mapping[str, Any], calibration_file: CalibrationFile
) -> None:
    root = ElementTree.fromstring(dcc_text(calibration_file, LABORATORY))
    found = {
        quantity.findtext("dcc:name/dcc:content", "", NAMES): quantity.find(
            "si:real", NAMES
        )
        for quantity in root.iter(f"{{{DCC}}}quantity")
    }

    def number(name: str, entry: str) -> float:
        real = found[name]
        assert real is not None
        return float(real.findtext(entry, "", NAMES))

    for i, axis in enumerate("xyz"):
        name = f"Tip {axis}"
        uncertainty = "si:expandedUnc/si:uncertainty"
        assert number(name, "si:value") == stated["tip_pen_mm"][i]
        assert number(name, uncertainty) == stated["expanded_uncertainty_mm"][i]
    covariance = stated["covariance"]
    assert number("Covariance of tip x and z", "si:value") == covariance[0][2]


def test_it_says_that_it_is_no_certificate_and_of_which_json_it_is(
    calibration_file: CalibrationFile,
) -> None:
    text = dcc_text(calibration_file, LABORATORY)

    assert NO_CERTIFICATE in text
    assert f"lightpen-{calibration_file.sha256}" in text


def test_texts_that_xml_cannot_hold_are_made_fit(
    stated: Mapping[str, Any], schema: "XMLSchema", tmp_path: Path
) -> None:
    changed = json.loads(json.dumps(stated))
    changed["inputs"]["pen"]["file"] = " le\x01ds <&>\n\t.csv "
    file = tmp_path / "tip.json"
    file.write_bytes(record_bytes(changed))

    text = dcc_text(read_calibration(file), LABORATORY)

    assert faults(schema, text) == []
    assert "le ds &lt;&amp;&gt; .csv" in text
