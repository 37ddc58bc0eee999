"""Opens a robot's memory and judges whether it can be trusted; a robot that has lost its memory starts stopped."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from hvcpd.errors import NewerStoreError, StoreError
from hvcpd.memory.latch import IDENTITY_BITS, Latched, Permit, StopLatch
from hvcpd.memory.store import Store
from hvcpd.memory.store_file import make_directory

STOPPED = "stopped"
"""The flag of a stopped robot in a memory from before there were latches."""


@dataclass(frozen=True)
class MemoryFiles:
    """The paths of a robot's memory; only robots with a key write `seals`."""

    tasks: Path
    seals: Path
    latch: Path

    def are_new(self) -> bool:
        """Whether the folder has no trace of an earlier run, not even a damaged file or a journal."""
        try:
            names = [file.name for file in self.tasks.parent.iterdir()]
        except FileNotFoundError:
            return True
        except OSError:
            return False
        known = (self.tasks.name, self.seals.name)
        return not any(name == self.latch.name or name.startswith(known) for name in names)


@dataclass(frozen=True)
class Memory:
    """The result of `open_memory`.

    `latched` is the present content of the latch; `loss`: why the robot's knowledge is gone or cannot be trusted, None
    if it is intact; `fault`: why a file cannot be used at all, so that its store is in memory only; `failing`: why
    nothing could be written just now. `seals_lost`: the counters of seals are gone; `seals_stale`: they may lag behind.
    """

    store: Store
    seals: Store | None
    latched: Latched
    loss: str | None = None
    fault: str | None = None
    failing: str | None = None
    seals_lost: bool = False
    seals_stale: bool = False

    @property
    def stopped(self) -> bool:
        """Whether the robot must start stopped."""
        return self.latched.permit is not Permit.FREE


def open_memory(files: MemoryFiles, latch: StopLatch, has_key: bool, lost: Sequence[str] = ()) -> Memory:
    """Open the memory and prepare it for this run: mark its state, and set the latch.

    `lost` is what is known to be lost besides these files.

    Raises StoreError if its folder cannot be made, and NewerStoreError if a newer version wrote it. Any other fault
    only makes the robot start stopped.
    """
    make_directory(files.tasks.parent)
    is_first = files.are_new()
    before = latch.read()
    store, fault = _opened(files.tasks)
    seals, seals_fault = _opened(files.seals, durable=True) if has_key else (None, None)
    losses = [*lost, *(_losses(files, store, before, is_first) if fault is None else [] if is_first else [fault])]
    seals_lost = seals is not None and _are_seals_lost(seals, before, is_first)
    if seals_lost:
        losses.append(seals_fault or f"{files.seals}: the counters of seals are lost")
    is_latched = before.permit is Permit.STOPPED if before is not None else STOPPED in store.flags()
    stopped = is_latched or bool(losses) or fault is not None or latch.spare() is not None
    after = Latched(
        Permit.STOPPED if stopped else Permit.FREE,
        _identity(store if fault is None else None, before.memory if before is not None else None),
        _identity(seals if seals_fault is None else None, before.seals if before is not None else None),
    )
    failing = None
    try:
        if before is None and not stopped:
            latch.write(replace(after, permit=Permit.NEW))
        for each, identity in ((store, after.memory), (seals, after.seals)):
            if each is not None and identity is not None:
                each.mark(identity)
        latch.write(after)
    except StoreError as error:
        failing = str(error)
        after = replace(after, permit=Permit.STOPPED)
        with suppress(StoreError):  # the next writer gets the error
            latch.write(after)
    loss = "; ".join(losses) or None
    is_stale = failing is not None or (before is not None and before.permit is Permit.UNSURE)
    return Memory(store, seals, after, loss, fault or seals_fault, failing, seals_lost, is_stale)


def _opened(path: Path, durable: bool = False) -> tuple[Store, str | None]:
    """The store, or one in memory and the fault of the file. Raises NewerStoreError."""
    try:
        return Store(path, durable=durable), None
    except NewerStoreError:
        raise
    except StoreError as error:
        return Store(), str(error)


def _identity(store: Store | None, before: int | None) -> int | None:
    """The number of a store, a new one if it has none; without a store the one that its file had before."""
    return before if store is None else store.identity or secrets.randbits(IDENTITY_BITS) + 1


def _losses(files: MemoryFiles, store: Store, before: Latched | None, is_first: bool) -> Iterator[str]:
    """The parts of the earlier memory that are missing."""
    path = files.tasks
    if store.damage is not None:
        yield f"{path} was damaged ({store.damage}), and is set aside"
    elif before is None:
        if store.identity is not None:
            yield f"{files.latch} is missing"
        elif store.is_new and not is_first:
            yield f"{path} is missing"
    elif before.permit is Permit.UNSURE:
        why = "cannot be read" if before.memory is None else "the last shutdown could not save everything"
        yield f"{files.latch}: {why}"
    elif before.permit is not Permit.NEW and before.memory != store.identity:
        yield f"{path} is missing or empty" if store.is_new else f"{path} is not the memory that was there before"


def _are_seals_lost(seals: Store, before: Latched | None, is_first: bool) -> bool:
    """Whether counters of seals existed that are now missing."""
    if seals.damage is not None:
        return True
    if before is None or before.memory is None:  # nobody knows whether there were any
        return seals.is_new and not is_first and before is not None
    return before.seals is not None and seals.identity != before.seals
