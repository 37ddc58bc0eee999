"""A medium of real air: one sound card that all robots of a `SharedRoom` share, and a visitor who types.

The loudspeaker plays the sum of the robots' sounds, and all of them hear the one microphone.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

import numpy as np

from hil_fakes.room import Point
from hil_fakes.shared_room import Voice
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio_exchange import SoundStream, StreamCounters
from hvcpd.ports import Samples


class SharedCard:
    """`make` makes the card's stream; after a failure the first caller opens the card again."""

    def __init__(self, make: Callable[[], SoundStream]) -> None:
        self._make = make
        self._card: SoundStream | None = None
        self._is_started = False
        self._door = asyncio.Lock()
        self.visitor = Voice()

    @property
    def latency_s(self) -> float:
        """The card's."""
        return self._card.latency_s if self._card is not None else 0.0

    @property
    def counters(self) -> StreamCounters:
        """The card's."""
        return self._card.counters if self._card is not None else StreamCounters()

    async def open(self) -> None:
        """Open the card, unless it is open. Raises DeviceError."""
        async with self._door:
            if self._card is None:
                card = self._make()
                await card.open()
                self._card, self._is_started = card, False

    async def exchange(self, played: Sequence[Samples], _places: Sequence[Point]) -> list[Samples]:
        """Play the sum and wait for the next block heard. Raises DeviceError, and lets go of the card."""
        if self._card is None:
            raise DeviceError("the sound card is gone")
        try:
            if self._is_started:
                said = np.sum([*played, self.visitor.take(played)], axis=0)
                self._card.write(np.clip(said, -1.0, 1.0).astype(np.float32))
            else:
                await self._card.start()
                self._is_started = True
            heard = await self._card.read()
        except DeviceError:
            await self.close()
            raise
        return [heard for _ in played]

    async def close(self) -> None:
        """Let go of the card."""
        card, self._card = self._card, None
        if card is not None:
            await card.close()
