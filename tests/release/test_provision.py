"""The Ansible role and cloud-init's file make a robot's settings that hvcpd takes; each is checked by its own tool."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest
import yaml

from hvcpd.config.settings_file import load_settings
from release.libraries import REPOSITORY

pytestmark = pytest.mark.slow

USER_DATA = REPOSITORY / "release/cloud-init/user-data"
PLAYBOOK = REPOSITORY / "release/ansible/robots.yml"


def tool(name: str, package: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is missing: apt install {package}")
    return found


def ran(command: Sequence[str], folder: Path) -> str:
    environment = {**os.environ, "ANSIBLE_LOCAL_TEMP": str(folder), "ANSIBLE_REMOTE_TEMP": str(folder)}
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_cloud_init_takes_its_file(tmp_path: Path) -> None:
    assert "Valid" in ran([tool("cloud-init", "cloud-init"), "schema", "--config-file", str(USER_DATA)], tmp_path)


def test_cloud_init_writes_settings_that_hvcpd_takes(tmp_path: Path) -> None:
    written = {each["path"]: each["content"] for each in yaml.safe_load(USER_DATA.read_text())["write_files"]}
    settings = tmp_path / "hvcpd.yaml"
    settings.write_text(written["/etc/hvcpd/hvcpd.yaml"])
    assert load_settings(settings).name == "Rob"


@pytest.mark.parametrize(
    ("password", "key", "is_off"), [("*", "", False), ("$6$salt$hash", "", True), ("*", "ssh-ed25519 AAAA", True)]
)
def test_wifi_is_switched_off_only_where_somebody_can_log_in(
    password: str, key: str, is_off: bool, tmp_path: Path
) -> None:
    command = next(each for each in yaml.safe_load(USER_DATA.read_text())["runcmd"] if "disable-wifi" in each)
    (tmp_path / "authorized_keys").write_text(key)
    (tmp_path / "getent").write_text(f"#!/bin/sh\necho 'robots:{password}:20000:0:99999:7:::'\n")
    (tmp_path / "getent").chmod(0o755)
    for place, here in (("/home/robots/.ssh", tmp_path), ("/boot/firmware", tmp_path)):
        command = command.replace(place, str(here))
    subprocess.run(["/bin/sh", "-c", command], check=True, env={"PATH": f"{tmp_path}:/usr/bin:/bin"})
    assert (tmp_path / "config.txt").exists() == is_off


@pytest.mark.parametrize(
    ("told_names", "names"), [({}, ("Rob", "Bot")), ({"hvcpd_names": "Rob,Bot,Ada"}, ("Rob", "Bot", "Ada"))]
)
def test_the_role_writes_settings_that_hvcpd_takes(
    told_names: dict[str, str], names: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "team.key").write_text("what the copy of it is compared with")
    told = {"hvcpd_etc": tmp_path, "hvcpd_name": "Ada", "hvcpd_tasks": REPOSITORY / "etc/tasks.yaml", **told_names}
    more = [part for key, value in told.items() for part in ("--extra-vars", f"{key}={value}")]
    play = [tool("ansible-playbook", "ansible-core"), "--inventory", "robot,", "--connection", "local", str(PLAYBOOK)]
    ran([*play, "--syntax-check"], tmp_path)
    ran([*play, *more, "--tags", "settings", "--extra-vars", '{"ansible_become": false}'], tmp_path)
    settings = load_settings(tmp_path / "hvcpd.yaml")
    assert (settings.name, settings.team, settings.names) == ("Ada", "plant", names)
    assert settings.tasks == tmp_path / "tasks.yaml"
    assert settings.tasks.read_text() == (REPOSITORY / "etc/tasks.yaml").read_text()


def test_wifi_stays_on_where_the_command_line_says_so(tmp_path: Path) -> None:
    """A value of --extra-vars KEY=VALUE is a text, and "false" is a text that is not empty. --check changes nothing."""
    boot = tmp_path / "config.txt"
    boot.write_text("")
    told = {"hvcpd_boot": boot, "hvcpd_wifi_off": "false"}
    more = [part for key, value in told.items() for part in ("--extra-vars", f"{key}={value}")]
    play = [tool("ansible-playbook", "ansible-core"), "--inventory", "robot,", "--connection", "local", str(PLAYBOOK)]
    done = ran([*play, *more, "--check", "--tags", "wifi", "--extra-vars", '{"ansible_become": false}'], tmp_path)
    assert "changed=0" in done
    assert "skipped=1" in done


def test_no_condition_of_the_role_is_a_text_by_itself() -> None:
    for path in (PLAYBOOK.parent / "roles").rglob("*.yml"):
        for step in yaml.safe_load(path.read_text()) or ():
            condition = str(step.get("when", "")) if isinstance(step, dict) else ""
            assert not condition.isidentifier(), f"{path.name}: write `{condition} | bool`"
