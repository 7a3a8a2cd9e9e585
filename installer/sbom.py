"""What is in the installer, as CycloneDX lists it."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any
from uuid import NAMESPACE_URL, uuid5

SPECIFICATION = "1.6"
SUPPLIER = "The lightpen developers"
LICENCE = "MIT AND OFL-1.1"


@dataclass(frozen=True)
class BundledPart:
    """One thing that was put into it.

    Attributes
    ----------
    file : str
        That it came in.
    sha256 : str
        Digest of the file.
    purl : str
        Package URL.
    licence : str
        Expression of SPDX.
    supplier : str
        Who makes it.
    cpe : str
        Its name among those of known vulnerabilities.
    """

    name: str
    version: str
    file: str
    sha256: str
    purl: str
    licence: str
    supplier: str
    cpe: str


def cpe(product: str, version: str) -> str:
    """Return the name of a version by the vendor and product that CPE knows."""
    return f"cpe:2.3:a:{product.replace('+', chr(92) + '+')}:{version}:*:*:*:*:*:*:*"


def bill_of_materials(
    version: str, components: Iterable[BundledPart], moment: int
) -> bytes:
    """Return the list as JSON, always the same for the same components.

    Parameters
    ----------
    version : str
        Of Lightpen.
    moment : int
        Of the commit, s since 1970.
    """
    entries = [_entry(component) for component in components]
    identity = json.dumps([version, entries], sort_keys=True)
    bill: Mapping[str, Any] = {
        "bomFormat": "CycloneDX",
        "specVersion": SPECIFICATION,
        "serialNumber": f"urn:uuid:{uuid5(NAMESPACE_URL, identity)}",
        "version": 1,
        "metadata": {
            "timestamp": datetime.fromtimestamp(moment, UTC).isoformat(),
            "component": {
                "type": "application",
                "bom-ref": "lightpen",
                "name": "lightpen",
                "version": version,
                "supplier": {"name": SUPPLIER},
                "licenses": [{"expression": LICENCE}],
            },
        },
        "components": entries,
        "dependencies": [
            {"ref": "lightpen", "dependsOn": [entry["bom-ref"] for entry in entries]}
        ],
    }
    return (json.dumps(bill, indent=2) + "\n").encode()


def _entry(component: BundledPart) -> dict[str, Any]:
    return {
        "type": "library",
        "bom-ref": f"{component.purl}#{component.file}",
        "supplier": {"name": component.supplier},
        "name": component.name,
        "version": component.version,
        "cpe": component.cpe,
        "purl": component.purl,
        "licenses": [{"expression": component.licence}],
        "hashes": [{"alg": "SHA-256", "content": component.sha256}],
        "properties": [{"name": "lightpen:file", "value": component.file}],
    }
