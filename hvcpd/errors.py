"""The errors that a person can cause or mend; each carries the exit status of its command.

Our own misuse raises ordinary Python errors. What comes from outside and cannot be used (a bad file, a missing
device) raises one of these; a command prints its text, which names the place and the remedy, and no traceback.
"""

EX_OK = 0
EX_FAILURE = 1
EX_USER = 2
"""What `hvcpctl` returns for bad input."""
EX_NOT_RUNNING, EX_NOT_ALLOWED = 3, 4
"""What `hvcpctl` returns where no daemon runs, and where it may not be asked; as the Linux Standard Base has them."""

# sysexits.h, for the daemon.
EX_USAGE = 64
EX_DATAERR = 65
EX_NOINPUT = 66
EX_UNAVAILABLE = 69
EX_SOFTWARE = 70
EX_OSERR = 71
EX_CANTCREAT = 73
EX_IOERR = 74
EX_NOPERM = 77
EX_CONFIG = 78
EX_INTERRUPTED = 130
"""As a shell has it of a program that SIGINT ended: 128 and the signal's number."""


class HvcpdError(Exception):
    """Something outside is wrong, and the text says what and how to mend it."""

    exit_status = EX_SOFTWARE
    """The daemon's exit status (sysexits.h)."""
    command_status = EX_USER
    """And that of `hvcpctl`."""


class ConfigError(HvcpdError):
    """The configuration, a task file or a lexicon is wrong; all its faults are in one text."""

    exit_status = EX_CONFIG


class PhraseError(HvcpdError):
    """A sentence is outside the phrasebook."""

    exit_status = EX_DATAERR


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
    """The daemon lives, and has no time for us: too many programs ask it."""


class KeyFileError(HvcpdError):
    """The team's key is missing, open to others or broken; the text never holds any of it."""

    exit_status = EX_CONFIG
