"""The Python libraries inside the Debian package: the lock's wheels for the wanted computer, and hvcpd itself, without
what no robot needs of them. Why they are there: docs/decisions/packaging.md.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from release.lock import Locked, Target
from release.symbols import without_symbols
from release.words import default_words, write_words

REPOSITORY = Path(__file__).parents[1]
WEIGHTS = Path("hvcpd/synthesis/acoustic_net.npz")
LEFT_OUT = frozenset(
    {"setuptools", "pygments", "markdown-it-py", "mdurl", "pycparser", "tzdata", "cryptography", "idna", "click"}
)
"""In the lock and not in the package: what only `pip install .` runs; what rich needs to show source code and Markdown,
anyio for domain names beyond ASCII, cffi to read C, and uvicorn for its command, which nobody asks of them; and what
Debian has itself, with its security updates."""
UNUSED = (
    "_soundfile_data/COPYING",
    "_yaml",
    "anyio/_backends/_trio.py",
    "anyio/pytest_plugin.py",
    "cattr",
    "cattrs/preconf",
    "cattrs/strategies",
    "cattrs/subclasses.py",
    "cffi",
    "dynamixel_easy_sdk",
    "markupsafe/_speedups.*",
    "numpy/char",
    "numpy/conftest.py",
    "numpy/core",
    "numpy/ctypeslib",
    "numpy/distutils",
    "numpy/doc",
    "numpy/f2py",
    "numpy/lib/*user_array*.py",
    "numpy/lib/recfunctions.py",
    "numpy/ma/mrecords.py",
    "numpy/ma/testutils.py",
    "numpy/matlib.py",
    "numpy/polynomial",
    "numpy/random/_examples",
    "numpy/random/lib",
    "numpy/strings",
    "numpy/testing",
    "numpy/typing/mypy_plugin.py",
    "numpy/_configtool.py",
    "numpy/_pyinstaller",
    "numpy/_core/include",
    "numpy/_core/defchararray.py",
    "numpy/_core/lib",
    "numpy/_core/strings.py",
    "numpy/_core/_simd.*.so",
    "numpy/_core/*_tests.*.so",
    "numpy/linalg/lapack_lite.*.so",
    "rich/_unicode_data/unicode[4-9]*.py",
    "rich/_unicode_data/unicode1[0-6]*.py",
    "rich/_win*.py",
    "rich/layout.py",
    "rich/logging.py",
    "rich/markdown.py",
    "rich/prompt.py",
    "rich/syntax.py",
    "rich/traceback.py",
    "rich/tree.py",
    "serial/rfc2217.py",
    "serial/rs485.py",
    "serial/serialcli.py",
    "serial/serialjava.py",
    "serial/*win32.py",
    "serial/threaded",
    "serial/tools",
    "serial/urlhandler",
    "shtab/click.py",
    "starlette/config.py",
    "starlette/endpoints.py",
    "starlette/middleware/authentication.py",
    "starlette/middleware/cors.py",
    "starlette/middleware/gzip.py",
    "starlette/middleware/httpsredirect.py",
    "starlette/middleware/opentelemetry.py",
    "starlette/middleware/sessions.py",
    "starlette/middleware/trustedhost.py",
    "starlette/middleware/wsgi.py",
    "starlette/schemas.py",
    "starlette/staticfiles.py",
    "starlette/templating.py",
    "starlette/testclient.py",
    "uvicorn/loops/*uvloop.py",
    "uvicorn/protocols/http/*tt*_impl.py",
    "uvicorn/protocols/websockets/*_impl.py",
    "uvicorn/supervisors",
    "uvicorn/workers.py",
    "yaml/_yaml.*.so",
    "**/*.pyi",
    "**/*.pxd",
    *(f"*.dist-info/{name}" for name in ("INSTALLER", "RECORD", "REQUESTED", "WHEEL", "top_level.txt")),
)
"""Parts of wheels that only compilers, type checkers, tests, pip and other systems need, or that need what is left out;
of cffi soundfile and sounddevice load only `_cffi_backend`; and a second way to the motors."""
REPLACED = {
    "numpy/_core/_add_newdocs.py": "",
    "numpy/_core/_add_newdocs_scalars.py": "",
    "rich/_emoji_codes.py": "EMOJI: dict[str, str] = {}\n",
    "rich/_unicode_data/_versions.py": 'VERSIONS = ("17.0.0",)\n',
    "uvicorn/main.py": "from uvicorn.server import Server\n\nmain = run = None\n",
}
"""Files that are loaded, but of which nobody needs what they hold: docstrings of compiled functions, emojis by their
names, the widths of characters in older versions of Unicode, and uvicorn's command."""
STRIP = {"amd64": "x86_64-linux-gnu-strip", "arm64": "aarch64-linux-gnu-strip"}
"""Of Debian's binutils for each architecture."""
SHIPPED = "hvcpd/synthesis/shipped"


def put_libraries(folder: Path, wanted: Sequence[Locked], target: Target) -> None:
    """Put the locked wheels and our own two packages there, without tests, compiled files and commands of theirs.

    Raises CalledProcessError, or FileNotFoundError where a tool is missing.
    """
    folder.mkdir(parents=True)
    install_wheels(wanted, target, folder)
    for name in ("hvcpd", "hil_fakes"):
        shutil.copytree(REPOSITORY / name, folder / name)
    shutil.rmtree(folder / SHIPPED, ignore_errors=True)
    write_words(default_words(), folder / SHIPPED)
    (folder / WEIGHTS).unlink()
    for unused in ("bin", *UNUSED):
        for path in folder.glob(unused):
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()
    for name, text in REPLACED.items():
        (folder / name).write_text(text, encoding="utf-8")
    for leftover in [path for name in ("tests", "__pycache__") for path in folder.rglob(name) if path.is_dir()]:
        shutil.rmtree(leftover, ignore_errors=True)  # one may lie in another
    _strip(folder, target)
    _link_libsndfile(folder / "_soundfile_data", target)


def install_wheels(wanted: Sequence[Locked], target: Target, folder: Path) -> None:
    """Unpack the wheels of exactly these versions and hashes for `target`. Raises CalledProcessError."""
    with _requirements(wanted) as requirements:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
        pip += ["--no-compile", "--require-hashes", "--target", str(folder), *target.pip_options()]
        run(*pip, "--requirement", requirements)


def write_bill_of_materials(wanted: Sequence[Locked], path: Path) -> None:
    """Write what the package is made of as CycloneDX 1.6 JSON; the same lock gives the same bytes.

    Raises CalledProcessError.
    """
    with _requirements(wanted) as requirements:
        bill = [sys.executable, "-W", "ignore", "-m", "cyclonedx_py", "requirements", requirements, "--sv", "1.6"]
        bill += ["--pyproject", str(REPOSITORY / "pyproject.toml"), "--output-reproducible"]
        run(*bill, "--output-file", str(path))


@contextmanager
def _requirements(wanted: Sequence[Locked]) -> Iterator[str]:
    """The name of a requirements file with these lines."""
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        file.write("".join(f"{locked.line}\n" for locked in wanted))
        file.flush()
        yield file.name


def _strip(folder: Path, target: Target) -> None:
    """Leave out what only a debugger reads of compiled modules. Raises FileNotFoundError without the tool."""
    modules = [str(path) for path in sorted(folder.rglob("*.so*")) if path.parent.suffix != ".libs"]
    run(STRIP[target.architecture], "--strip-unneeded", *modules)
    for library in folder.glob("*.libs/*"):  # of auditwheel
        library.write_bytes(without_symbols(library.read_bytes()))


def _link_libsndfile(folder: Path, target: Target) -> None:
    """Put Debian's libsndfile in place of the wheel's, where soundfile looks for it first. Raises ValueError if that is
    not one file."""
    (wheels,) = folder.glob("libsndfile_*.so")
    wheels.unlink()
    wheels.symlink_to(f"../../{target.machine}-linux-gnu/libsndfile.so.1")


def run(*command: str) -> None:
    """Raises CalledProcessError."""
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL)
