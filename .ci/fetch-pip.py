"""Installs pip into this Python's environment from the index PIP_INDEX_URL, where Debian has left ensurepip out."""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import urljoin
from urllib.request import urlopen

WHEEL = "pip-25.0.1-py3-none-any.whl"
SHA256 = "c46efd13b6aa8279f33f2864459c8ce587ea6a1a59ee20de055868d8f7688f7f"
"""As PyPI has it, of 9 February 2025: the last version needs nothing but Python 3.8 or newer."""
INDEX = os.environ.get("PIP_INDEX_URL", "")
"""As pip has it; without it there is none, since no host is named here."""
PATIENCE_S = 60


def main() -> None:
    """Fetch the wheel, compare its digest, and have it install itself. Raises OSError, or exits with the reason."""
    if not INDEX:
        sys.exit("PIP_INDEX_URL names no package index")
    page_url = f"{INDEX.rstrip('/')}/pip/"
    with urlopen(page_url, timeout=PATIENCE_S) as page:
        links = re.findall(r'href="([^"]+)"', page.read().decode())
    link = next((link for link in links if f"/{WHEEL}" in link or link.startswith(WHEEL)), None)
    if link is None:
        sys.exit(f"{page_url} has no {WHEEL}")
    with urlopen(urljoin(page_url, link.partition("#")[0]), timeout=PATIENCE_S) as file:
        data = file.read()
    if hashlib.sha256(data).hexdigest() != SHA256:
        sys.exit(f"{WHEEL} from {page_url} is not the file that PyPI has")
    with tempfile.TemporaryDirectory() as folder:
        wheel = Path(folder) / WHEEL
        wheel.write_bytes(data)
        command = [sys.executable, f"{wheel}/pip", "install", "--quiet", "--no-index", "--no-deps", str(wheel)]
        subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
