"""The software bill of materials: what hvcpd is made of, as CycloneDX 1.6 JSON, from the lock file and nothing else.

python -m release.sbom [FILE]: to the file, or to standard output. The same lock gives the same bytes.
"""

from __future__ import annotations

import json
import sys
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hvcpd import __version__
from release.lock import Locked, LockError, read_lock

_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_URL, "pkg:pypi/hvcpd")
"""Of the serial numbers, which CycloneDX wants as a UUID; one of version 5 follows from the contents."""


def bill_of_materials(lock: Sequence[Locked]) -> dict[str, Any]:
    """The document, as plain values. A package locked in two versions is two components, each with its marker."""
    root = _purl("hvcpd", __version__)
    components = [_component(locked) for locked in sorted(lock, key=lambda each: (each.name, each.version))]
    contents = json.dumps([root, components], sort_keys=True)
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{uuid.uuid5(_NAMESPACE, contents)}",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": root,
                "name": "hvcpd",
                "version": __version__,
                "purl": root,
                "licenses": [{"license": {"id": "Apache-2.0"}}],
            }
        },
        "components": components,
        "dependencies": [{"ref": root, "dependsOn": [component["bom-ref"] for component in components]}],
    }


def _component(locked: Locked) -> dict[str, Any]:
    purl = _purl(locked.name, locked.version)
    component: dict[str, Any] = {
        "type": "library",
        "bom-ref": purl,
        "name": locked.name,
        "version": locked.version,
        "purl": purl,
        "scope": "required",
        # One for each file that may be installed: a wheel for each platform, and the sources.
        "hashes": [{"alg": "SHA-256", "content": digest} for digest in locked.hashes],
    }
    if locked.marker is not None:
        component["properties"] = [{"name": "hvcpd:python-marker", "value": locked.marker}]
    return component


def _purl(name: str, version: str) -> str:
    """The package's URL (package-url specification, type pypi); our names and versions need no escapes."""
    return f"pkg:pypi/{name}@{version}"


def main(arguments: Sequence[str]) -> int:
    """Write the bill; returns the exit status."""
    try:
        text = json.dumps(bill_of_materials(read_lock()), indent=2) + "\n"
    except LockError as error:
        sys.stderr.write(f"sbom: {error}\n")
        return 2
    if arguments:
        path = Path(arguments[0])
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    else:
        sys.stdout.write(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
