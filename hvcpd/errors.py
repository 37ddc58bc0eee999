"""The errors that a person can cause or mend; each carries the exit status of its command.

Our own misuse raises ordinary Python errors. What comes from outside and cannot be used (a bad file, a missing
device) raises one of these; a command prints its text, which names the place and the remedy, and no traceback.
`did_you_mean`, `unwritable` and `unreadable` make the parts of such texts that many of them share.
"""

from __future__ import annotations

import errno
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

EX_OK = 0
EX_FAILURE = 1
EX_USER = 2
"""What `hvcpctl` returns for what its user has to mend: bad input, or a device that is missing."""
EX_NOT_RUNNING, EX_NOT_ALLOWED = 3, 4
"""What `hvcpctl` returns where no daemon runs, and where it may not be asked; as the Linux Standard Base has them."""

# sysexits.h, for the daemon.
EX_USAGE = 64
EX_DATAERR = 65
EX_NOINPUT = 66
EX_UNAVAILABLE = 69
EX_SOFTWARE = 70
EX_CANTCREAT = 73
EX_NOPERM = 77
EX_CONFIG = 78
EX_INTERRUPTED = 130
"""As a shell has it of a program that SIGINT ended: 128 and the signal's number."""


class HvcpdError(Exception):
    """Something outside is wrong, and the text says what and how to mend it."""

    exit_status = EX_SOFTWARE
    """The daemon's exit status (sysexits.h)."""
    command_status = EX_USER
    """Exit status of `hvcpctl` for this error."""


class ConfigError(HvcpdError):
    """The configuration, a task file or a lexicon is wrong; all its faults are in one text."""

    exit_status = EX_CONFIG


class PhraseError(HvcpdError):
    """A sentence is outside the phrasebook."""

    exit_status = EX_DATAERR


class VocabularyError(PhraseError):
    """Words of a team clash with each other or with the phrasebook; `key` is the setting that they come from. `others`
    are further ones, each of which is a line of the text."""

    def __init__(self, text: str, key: str, *others: VocabularyError, written: str = "") -> None:
        """`key`: the setting that the words come from; `written`: the words, as they are written there."""
        self.key, self.written = key, written
        own = (text, key, written)
        self._lines: list[tuple[str, str, str]] = [own, *(line for other in others for line in other._lines)]
        super().__init__("\n".join(line for line, *_ in self._lines))

    def at(self, place: Callable[[str], str]) -> str:
        """The text, each line with the place to mend it: that of the words in the file of the tasks, which `place`
        finds, or the key of the settings."""
        return "\n".join(f"{place(written) if key == 'tasks' else key}: {text}" for text, key, written in self._lines)


class AudioFileError(HvcpdError):
    """A sound file is missing, broken or of a kind that we cannot read."""

    exit_status = EX_NOINPUT


class DeviceError(HvcpdError):
    """A sound card, a serial port or a motor is missing or refuses."""

    exit_status = EX_UNAVAILABLE


class StoreError(HvcpdError):
    """The robot's memory cannot be opened or written."""

    exit_status = EX_CANTCREAT


class NewerStoreError(StoreError):
    """The robot's memory was written by a newer version, and is left as it is."""

    exit_status = EX_CONFIG


class RunningError(HvcpdError):
    """A daemon of the same name runs already."""

    exit_status = EX_UNAVAILABLE


class NotRunningError(HvcpdError):
    """There is no daemon to be asked."""

    exit_status = EX_UNAVAILABLE
    command_status = EX_NOT_RUNNING


class NotAllowedError(HvcpdError):
    """This user may not ask the daemon."""

    exit_status = EX_NOPERM
    command_status = EX_NOT_ALLOWED


class NotDoneError(HvcpdError):
    """The daemon was asked, and did not do it."""

    exit_status = EX_UNAVAILABLE
    command_status = EX_FAILURE


class BusyError(NotDoneError):
    """The daemon lives, and has no time for us: too many programs ask it, or it hangs."""


class KeyFileError(HvcpdError):
    """The team's key is missing, open to others or broken; the text never holds any of it."""

    exit_status = EX_CONFIG


DEBIAN_FOLDER = "/usr/lib/hvcpd/"
"""Where the Debian package has hvcpd; its Python sees Debian's packages, and no pip puts anything there."""


def how_to_install(packages: str, debian: str | None = None, here: str = __file__, prefix: str = sys.prefix) -> str:
    """Return the command that installs what is missing: `packages` of PyPI or, where the Debian package runs, `debian`.

    None: Debian has none that fits hvcpd's own libraries. `prefix` is the environment's folder.
    """
    if not here.startswith(DEBIAN_FOLDER):
        by_pipx = Path(prefix, "pipx_metadata.json").exists()
        return f"pipx runpip hvcpd install {packages}" if by_pipx else f"pip install {packages}"
    if debian is not None:
        return f"sudo apt install {debian}"
    return f"the Debian package has no room for it; install hvcpd by pipx (docs/install.md), then {packages} beside it"


def alike(wrong: str, known: Iterable[str], least: float = 0.6) -> str | None:
    """The known word that is spelled most alike, by difflib's ratio of 0 to 1; None if none has the `least`."""
    from difflib import get_close_matches  # only where something is wrong

    return next(iter(get_close_matches(wrong, list(known), 1, least)), None)


def nearest(wrong: str, known: Iterable[str]) -> str | None:
    """The known word that was probably meant: one that is spelled alike, or the only one that begins so. Case, and
    hyphens for underscores, do not count. None if there is none."""
    folded, word = {name.casefold().replace("-", "_"): name for name in known}, wrong.casefold().replace("-", "_")
    near = alike(word, folded)
    begun = [name for name in folded if name.startswith(word)] if word else []
    return folded[near] if near else folded[begun[0]] if len(begun) == 1 else None


def did_you_mean(wrong: str, known: Iterable[str]) -> str:
    """The end of a message on an unknown word: the nearest that is known, or all of them."""
    names = list(known)
    near = nearest(wrong, names)
    return f"did you mean {near!r}?" if near is not None else f"known are: {', '.join(names)}"


NO_TEMPORARY = "no folder for temporary files can be written: make room in /tmp, or set TMPDIR to another folder"
"""For the error of Python's tempfile, which names no file."""


def _nameless() -> str:
    """What is wrong where an error of a missing file names none, and what to do."""
    try:
        Path.cwd()
    except FileNotFoundError:
        return "the folder that this runs in has been deleted; change to another"
    return NO_TEMPORARY


def unwritable(path: Path | str, error: Exception, otherwise: str = "name a file that you may write") -> str:
    """Why a file cannot be written, and what to do; `otherwise` is the remedy where the reason suggests none."""
    if isinstance(error, FileNotFoundError) and error.filename is None:
        return _nameless()
    reason = getattr(error, "strerror", None) or str(error)
    if isinstance(error, FileExistsError):
        if Path(path).is_dir():
            return unwritable(path, IsADirectoryError(errno.EISDIR, "Is a directory"))
        reason = "there is a file of this name already"
    match getattr(error, "errno", None):
        case errno.ENOSPC | errno.EDQUOT | errno.EFBIG:
            remedy = "make room there, or name another place"
        case errno.EISDIR:
            remedy = "name a file in it"
        case errno.ENXIO:
            remedy = "name a file"
        case errno.ENOENT if not Path(path).parent.exists():
            remedy = f"there is no folder {Path(path).parent}; make it, or name another"
        case _:
            remedy = otherwise
    return f"{path}: cannot be written: {reason}; {remedy}"


@contextmanager
def writing(
    path: Path, kind: type[HvcpdError], option: str = "", otherwise: str = "name a file that you may write"
) -> Iterator[None]:
    """Raise an error of that kind where `path` cannot be written; `option` stands before the text of `unwritable`."""
    try:
        yield
    except OSError as error:
        raise kind(f"{option}{unwritable(path, error, otherwise)}") from None


@contextmanager
def reading_own(path: Path) -> Iterator[None]:
    """Raise ConfigError, with the remedy, where a file of the package is missing or damaged, whatever its reader
    raises."""
    try:
        yield
    except HvcpdError:
        raise
    except Exception as error:  # zipfile, zlib, NumPy and the readers raise all kinds for damaged files
        again = how_to_install("--force-reinstall ./hvcpd-*.whl", "--reinstall ./hvcpd_*.deb", str(path))
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise ConfigError(f"{path}: this file of hvcpd is missing or damaged ({reason}): {again}") from error


def unreadable(error: Exception) -> str:
    """What is wrong with a file that cannot be opened, and what to do."""
    match error:
        case FileNotFoundError(filename=None):
            return _nameless()
        case FileNotFoundError():
            return "there is no such file; check the name, or create it"
        case IsADirectoryError():
            return "this is a directory; name a file in it"
        case PermissionError():
            return "no permission to read it; run `chmod a+r` on it, or run as its owner"
        case OSError():
            return f"cannot be read ({error.strerror}); check the name and the disk"
        case _:
            return "this is not a file name; check it"
