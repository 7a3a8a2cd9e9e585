"""Write the winget manifests: ``python installer/manifests.py SETUP.exe URL``.

They state where the installer is downloaded from, and its digest, so they are written
when both are known. ``winget install --manifest FOLDER`` tries them.
"""

import argparse
import sys
from hashlib import sha256
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from lightpen import __version__

IDENTIFIER = "Lightpen.Lightpen"
SCHEMA = "1.6.0"
COMMON = f"PackageIdentifier: {IDENTIFIER}\nPackageVersion: {__version__}\n"
VERSION = "DefaultLocale: en-US\n"
LOCALE = """\
PackageLocale: en-US
Publisher: Lightpen project
PackageName: Lightpen
License: MIT AND OFL-1.1
ShortDescription: Calibrate the probe tip of a light pen from images of its LEDs
"""
INSTALLER = """\
MinimumOSVersion: 10.0.17763.0
InstallerType: nullsoft
ProductCode: Lightpen
UpgradeBehavior: install
InstallerSwitches:
  InstallLocation: /D=<INSTALLPATH>
ExpectedReturnCodes:
- InstallerReturnCode: 4
  ReturnResponse: systemNotSupported
- InstallerReturnCode: 5
  ReturnResponse: packageInUse
- InstallerReturnCode: 6
  ReturnResponse: downgrade
- InstallerReturnCode: 9
  ReturnResponse: diskFull
Installers:
- Architecture: x64
  Scope: user
  InstallerUrl: {url}
  InstallerSha256: {digest}
- Architecture: x64
  Scope: machine
  ElevationRequirement: elevationRequired
  InstallerSwitches:
    Custom: /ALLUSERS
  InstallerUrl: {url}
  InstallerSha256: {digest}
"""


def main() -> int:
    """Write them, and return the exit status."""
    parser = argparse.ArgumentParser(description="Write the winget manifests.")
    parser.add_argument("setup", type=Path, metavar="SETUP.exe")
    parser.add_argument("url", help="where it is downloaded from")
    options = parser.parse_args()
    folder = options.setup.parent / "winget"
    folder.mkdir(exist_ok=True)
    for name, text in manifests(options.setup, options.url).items():
        (folder / name).write_text(text, encoding="utf-8")
    print(folder)
    return 0


def manifests(setup: Path, url: str) -> dict[str, str]:
    """Return the three manifests by the names of their files."""
    digest = sha256(setup.read_bytes()).hexdigest().upper()
    parts = {
        "version": ("", VERSION),
        "defaultLocale": (".locale.en-US", LOCALE),
        "installer": (".installer", INSTALLER.format(url=url, digest=digest)),
    }
    return {
        f"{IDENTIFIER}{suffix}.yaml": (
            f"{COMMON}{text}ManifestType: {kind}\nManifestVersion: {SCHEMA}\n"
        )
        for kind, (suffix, text) in parts.items()
    }


if __name__ == "__main__":
    sys.exit(main())
