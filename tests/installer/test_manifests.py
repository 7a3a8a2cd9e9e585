"""The manifests of package managers state what the installer is."""

import re
from hashlib import sha256
from pathlib import Path

import yaml
from installer.manifests import manifests

from lightpen import __version__

ROOT = Path(__file__).parents[2]
URL = "https://example.org/Lightpen-setup.exe"


def test_winget_gets_version_digest_and_both_scopes(tmp_path: Path) -> None:
    setup = tmp_path / "setup.exe"
    setup.write_bytes(b"setup")

    read = {name: yaml.safe_load(text) for name, text in manifests(setup, URL).items()}

    assert {each["PackageVersion"] for each in read.values()} == {__version__}
    installers = read["Lightpen.Lightpen.installer.yaml"]["Installers"]
    assert [each["Scope"] for each in installers] == ["user", "machine"]
    digest = sha256(b"setup").hexdigest().upper()
    assert {each["InstallerSha256"] for each in installers} == {digest}
    assert installers[1]["InstallerSwitches"] == {"Custom": "/ALLUSERS"}


def test_exit_statuses_for_winget_and_it_are_those_of_the_installer() -> None:
    script = (ROOT / "installer" / "windows" / "lightpen.nsi").read_text("utf-8")
    stated = set(re.findall(r"(?:Refuse\}|SetErrorLevel) (\d+)", script))
    sheet = (ROOT / "docs" / "it.md").read_text("utf-8")
    rows = re.findall(r"^\| ([\d, ]+) \|", sheet, re.MULTILINE)
    reported = {number for row in rows for number in row.split(", ")}

    assert len(stated) > 6
    assert stated <= reported


def test_the_flatpak_takes_the_locked_versions() -> None:
    file = ROOT / "installer" / "linux" / "lightpen.flatpak.yaml"
    manifest = yaml.safe_load(file.read_text("utf-8"))

    (module,) = manifest["modules"]
    first = module["build-commands"][0]
    assert "--require-hashes --requirement requirements.lock" in first
    assert (file.parent / module["sources"][0]["path"]).resolve() == ROOT
