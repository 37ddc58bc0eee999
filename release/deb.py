"""The Debian packages: hvcpd with its libraries inside, for this computer or for another kind, and hvcpd-natural, the
weights of the natural voice's network, for any.

python -m release.deb [--python 3.13] [--architecture arm64] [--output dist]

The libraries are wheels for the wanted computer, checked against the lock's hashes, unpacked and not run; so a
package for Raspberry Pi OS can be made anywhere. Why it is done so: docs/decisions/packaging.md.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from email.utils import formatdate
from pathlib import Path

from hvcpd import __version__
from hvcpd.cli import make_parser as make_hvcpd
from hvcpd.control.cli import make_parser as make_hvcpctl
from hvcpd.control.completion import completion_of
from release.libraries import LEFT_OUT, REPOSITORY, WEIGHTS, put_libraries, run, write_bill_of_materials
from release.lock import GLIBC, MACHINES, LockError, Target, needed, read_lock
from release.manuals import put_manuals

TEMPLATES = Path(__file__).parent / "debian"
LIBRARIES = Path("usr/lib/hvcpd")
DOCUMENTS = Path("usr/share/doc/hvcpd")
MAINTAINER = "hvcpd maintainers <maintainers@hvcpd.invalid>"
"""There is no mailing list; whoever hands the package on puts a name with DEBFULLNAME and DEBEMAIL."""

SHELLS = {
    "bash": "usr/share/bash-completion/completions/{command}",
    "zsh": "usr/share/zsh/vendor-completions/_{command}",
    "fish": "usr/share/fish/vendor_completions.d/{command}.fish",
}

FILES = {
    "etc/hvcpd.yaml": "etc/hvcpd/hvcpd.yaml",
    "etc/lexicon.txt": "etc/hvcpd/lexicon.txt",
    "etc/tasks.yaml": "etc/hvcpd/tasks.yaml",
    "systemd/hvcpd.service": "usr/lib/systemd/system/hvcpd.service",
    "systemd/hvcpd@.service": "usr/lib/systemd/system/hvcpd@.service",
    "systemd/hvcpd-user.service": "usr/lib/systemd/user/hvcpd.service",
    "systemd/hvcpd-skills.service": "usr/lib/systemd/system/hvcpd-skills.service",
    "systemd/hvcpd.sysusers": "usr/lib/sysusers.d/hvcpd.conf",
    "systemd/hvcpd.tmpfiles": "usr/lib/tmpfiles.d/hvcpd.conf",
    "systemd/60-hvcpd.rules": "usr/lib/udev/rules.d/60-hvcpd.rules",
    "README.md": "usr/share/doc/hvcpd/README.md",
    "docs/install.md": "usr/share/doc/hvcpd/install.md",
    "docs/console.md": "usr/share/doc/hvcpd/console.md",
    "docs/duet.md": "usr/share/doc/hvcpd/duet.md",
    "docs/experiment.md": "usr/share/doc/hvcpd/experiment.md",
    "docs/skills.md": "usr/share/doc/hvcpd/skills.md",
    "CHANGELOG.md": "usr/share/doc/hvcpd/CHANGELOG.md",
    "release/debian/compile.py": "usr/share/hvcpd/compile.py",
    "release/debian/lintian-overrides": "usr/share/lintian/overrides/hvcpd",
    "release/debian/copyright": "usr/share/doc/hvcpd/copyright",
}
"""Destination of each file of the repository; those under etc/ are conffiles: what a person changed there stays."""

SMALLEST = ("-Zxz", "-z9", "-Sextreme")
"""dpkg-deb's options for a package that is handed on; it takes some minutes of processor time."""
AT_ONCE = ("-Znone",)
"""For one that is unpacked right away."""
SCRIPTS = ("postinst", "prerm", "postrm")
COMMANDS = {"hvcpd": "hvcpd.cli", "hvcpctl": "hvcpd.control.cli"}


def this_computer() -> Target:
    """The kind of computer that this process runs on. Raises LockError for one that no package is made for."""
    machine = platform.machine()
    debian = {theirs: ours for ours, theirs in MACHINES.items()}.get(machine, machine)
    return Target(f"{sys.version_info.major}.{sys.version_info.minor}", debian)


def build(target: Target, output: Path, version: str = __version__, compression: Sequence[str] = SMALLEST) -> Path:
    """Make the package in the folder `output`; its path. `compression`: options of dpkg-deb.

    Raises LockError, or CalledProcessError when pip or dpkg-deb fail (they have told why).
    """
    full_version = f"{version}+py{target.python.replace('.', '')}"
    with tempfile.TemporaryDirectory(prefix="hvcpd-deb-") as scratch:
        root = Path(scratch) / "root"
        wanted = [locked for locked in needed(read_lock(), target) if locked.name not in LEFT_OUT]
        put_libraries(root / LIBRARIES, wanted, target)
        _put_files(root, full_version)
        put_manuals(root / "usr/share/man")
        put_completions(root)
        write_bill_of_materials(wanted, root / DOCUMENTS / "sbom.cdx.json")
        _put_control(root, "control", _fields(target, full_version))
        _put_scripts(root / "DEBIAN")
        return _packed(root, output / f"hvcpd_{full_version}_{target.architecture}.deb", compression)


def build_natural(output: Path, version: str = __version__, compression: Sequence[str] = SMALLEST) -> Path:
    """Make the package of the natural voice's weights in the folder `output`; its path. Raises CalledProcessError."""
    name = "hvcpd-natural"
    with tempfile.TemporaryDirectory(prefix="hvcpd-deb-") as scratch:
        root = Path(scratch) / "root"
        for source, place in (
            (REPOSITORY / WEIGHTS, LIBRARIES / WEIGHTS),
            (TEMPLATES / "copyright-natural", Path("usr/share/doc") / name / "copyright"),
        ):
            (root / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, root / place)
        _put_changelog(root, name, version)
        _put_control(root, "control-natural", {"version": version})
        return _packed(root, output / f"{name}_{version}_all.deb", compression)


def _put_files(root: Path, version: str) -> None:
    for source, destination in FILES.items():
        path = root / destination
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(REPOSITORY / source, path)
    _put_changelog(root, "hvcpd", version)
    run("gzip", "--best", "--no-name", str(root / DOCUMENTS / "CHANGELOG.md"))
    (root / "usr/bin").mkdir(parents=True)
    launcher = (TEMPLATES / "launcher").read_text()
    for command, module in COMMANDS.items():
        (root / "usr/bin" / command).write_text(launcher.format(command=command, module=module))


def maintainer() -> str:
    """The maintainer of the package."""
    name, mail = os.environ.get("DEBFULLNAME"), os.environ.get("DEBEMAIL")
    return f"{name} <{mail}>" if name and mail else MAINTAINER


def _put_changelog(root: Path, package: str, version: str) -> None:
    changes = (REPOSITORY / "CHANGELOG.md").stat().st_mtime
    path = root / "usr/share/doc" / package / "changelog"
    path.write_text(debian_changelog(version, maintainer(), changes, package), encoding="utf-8")
    run("gzip", "--best", "--no-name", str(path))


def debian_changelog(version: str, who: str, changed_s: float, package: str = "hvcpd") -> str:
    """Return what Debian's tools read of a version whose changes were last written at `changed_s`, s since 1970."""
    day = formatdate(changed_s)
    entry = "  * See /usr/share/doc/hvcpd/CHANGELOG.md.gz."
    return f"{package} ({version}) stable; urgency=medium\n\n{entry}\n\n -- {who}  {day}\n"


def put_completions(root: Path) -> None:
    """Write what each shell completes both commands by. Raises OSError."""
    for command, parser in (("hvcpd", make_hvcpd()), ("hvcpctl", make_hvcpctl())):
        for shell, place in SHELLS.items():
            path = root / place.format(command=command)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(completion_of(parser, shell), encoding="utf-8")


def _fields(target: Target, version: str) -> dict[str, str]:
    """Of hvcpd's control file."""
    major, minor = target.python.split(".")
    return {
        "version": version,
        "architecture": target.architecture,
        "python": target.python,
        "next_python": f"{major}.{int(minor) + 1}",
        "glibc": str(GLIBC[target.python]),
    }


def _put_control(root: Path, template: str, fields: Mapping[str, str]) -> None:
    control = root / "DEBIAN"
    control.mkdir()
    installed_kib = sum(path.stat().st_size for path in _files(root)) // 1024
    text = (TEMPLATES / template).read_text().format(**fields, maintainer=maintainer(), installed_kib=installed_kib)
    (control / "control").write_text(text)
    sums = [(hashlib.md5(path.read_bytes()).hexdigest(), path.relative_to(root)) for path in _files(root)]
    (control / "md5sums").write_text("".join(f"{digest}  {path}\n" for digest, path in sums))


def _put_scripts(control: Path) -> None:
    for script in SCRIPTS:
        shutil.copyfile(TEMPLATES / script, control / script)
    conffiles = [f"/{destination}\n" for destination in FILES.values() if destination.startswith("etc/")]
    (control / "conffiles").write_text("".join(conffiles))


def _packed(root: Path, package: Path, compression: Sequence[str]) -> Path:
    _set_modes(root)
    package.parent.mkdir(parents=True, exist_ok=True)
    run("dpkg-deb", "--root-owner-group", *compression, "--build", str(root), str(package))
    return package


def _set_modes(root: Path) -> None:
    """Whatever the builder's umask: folders and programs 0755, files 0644."""
    programs = {root / "DEBIAN" / script for script in SCRIPTS}
    programs |= {root / "usr/bin" / command for command in COMMANDS}
    for path in (path for path in root.rglob("*") if not path.is_symlink()):
        path.chmod(0o755 if path.is_dir() or path in programs else 0o644)
    root.chmod(0o755)


def _files(root: Path) -> Iterator[Path]:
    """Every file of the package itself, in order."""
    return (path for path in sorted(root.rglob("*")) if path.is_file() and "DEBIAN" not in path.relative_to(root).parts)


def main(arguments: Sequence[str]) -> int:
    """Build both packages; returns the exit status."""
    parser = argparse.ArgumentParser(prog="release.deb", description="Build the Debian packages.")
    parser.add_argument("--python", choices=list(GLIBC), help="Python's version there (default: this one's)")
    parser.add_argument("--architecture", choices=list(MACHINES), help="Debian's name for it (default: this one's)")
    parser.add_argument("--output", type=Path, default=Path("dist"), metavar="DIR", help="default: dist")
    options = parser.parse_args(arguments)
    try:
        if options.python and options.architecture:
            target = Target(options.python, options.architecture)
        else:
            here = this_computer()
            target = Target(options.python or here.python, options.architecture or here.architecture)
        sys.stdout.write(f"{build(target, options.output)}\n{build_natural(options.output)}\n")
    except LockError as error:
        sys.stderr.write(f"deb: {error}\n")
        return 2
    except (subprocess.CalledProcessError, FileNotFoundError) as error:
        sys.stderr.write(
            f"deb: {error}; are dpkg-deb and binutils of that architecture there, and is the package index reached?\n"
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
