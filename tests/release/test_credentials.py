"""The team's key as systemd hands it over: what docs/install.md says of it, under a real systemd."""

from __future__ import annotations

from pathlib import Path

import pytest

from release.libraries import REPOSITORY
from tests.release.container import Container

pytestmark = [pytest.mark.container, pytest.mark.slow]

DROP_IN = "LoadCredential=hvcpd.key\n"
ENCRYPT = ("systemd-creds", "encrypt", "--name=hvcpd.key")


def started(robot: Container, name: str, credential: str) -> dict[str, str]:
    """A unit that shows the key that it is given, once it has run."""
    unit = f"[Service]\nType=oneshot\nRemainAfterExit=yes\n{credential}ExecStart=/bin/cat %d/hvcpd.key\n"
    (robot.root / "etc/systemd/system" / f"{name}.service").write_text(unit)
    robot.inside("systemctl", "daemon-reload")
    robot.asked("systemctl", "start", name)
    return robot.unit(name)


def test_an_encrypted_key_is_found_and_a_plain_one_with_a_line_more(debian: Path, tmp_path: Path) -> None:
    told = (REPOSITORY / "docs/install.md").read_text()
    assert DROP_IN in told
    assert " ".join(ENCRYPT) in told
    lines = (REPOSITORY / "systemd/hvcpd.service").read_text().splitlines(keepends=True)
    ours = next(line for line in lines if line.startswith("LoadCredential"))
    with Container(debian, tmp_path) as robot:
        for folder in ("credstore", "credstore.encrypted"):
            (robot.root / "etc" / folder).mkdir(mode=0o700, exist_ok=True)
        plain = robot.root / "etc/credstore/hvcpd.key"
        plain.write_text("a plain key\n")
        robot.boot({})
        assert started(robot, "refused", ours)["ExecMainStatus"] == "243", "not a robot without a key"
        assert started(robot, "plain", ours + DROP_IN)["Result"] == "success"
        assert "a plain key" in robot.journal("plain")
        robot.inside(*ENCRYPT, "/etc/credstore/hvcpd.key", "/etc/credstore.encrypted/hvcpd.key")
        plain.unlink()
        assert started(robot, "encrypted", ours)["Result"] == "success"
        assert "a plain key" in robot.journal("encrypted")
