"""Messages in the order of their stamps, however they arrive, and the state after them."""

from bisect import bisect_right
from collections.abc import Callable

from navstack.localization.gps_ekf_filter import FilterState

Apply = Callable[[FilterState], None]

_SLACK = 128  # messages that may be kept beyond the history's length, so that forgetting is rare
_START = -1  # rank of the state in which the history begins


class History:
    """The recent messages in the order of their stamps, and the state after each.

    A late message is put where it belongs and what follows is applied anew. The result is that of
    messages in order, for the same steps are taken. A message older than the history is refused.
    """

    def __init__(self, length: float, start: FilterState) -> None:
        """Begin with a state.

        Args:
            length: [s] of what is kept at least.
            start: before any message.
        """
        self._length = length
        # stamp and rank of each message
        self._keys: list[tuple[float, int]] = [(start.stamp, _START)]
        self._applied: list[Apply] = [_nothing]
        self._states = [start]
        self.latest = start  # after the newest message; not to be changed

    def insert(self, stamp: float, rank: int, apply: Apply) -> FilterState | None:
        """Apply a message at its time.

        Args:
            stamp: [s] of the message.
            rank: order among messages of one stamp.
            apply: changes a state as the message says.

        Returns:
            The state right after the message, not to be changed; None: the message is too old.
        """
        key = (stamp, rank)
        if key >= self._keys[-1]:
            self._append(key, apply)
            self._forget()
            return self.latest
        place = bisect_right(self._keys, key)
        if place == 0:
            return None
        later = list(zip(self._keys[place:], self._applied[place:], strict=True))
        del self._keys[place:], self._applied[place:], self._states[place:]
        self.latest = self._states[-1]
        self._append(key, apply)
        found = self.latest
        for again_key, again in later:
            self._append(again_key, again)
        return found

    def _append(self, key: tuple[float, int], apply: Apply) -> None:
        state = self.latest.copy()
        apply(state)
        self._keys.append(key)
        self._applied.append(apply)
        self._states.append(state)
        self.latest = state

    def _forget(self) -> None:
        """Drop what is too old, but the newest of it, from which what is kept begins."""
        oldest = self._keys[-1][0] - self._length
        if len(self._keys) > _SLACK and self._keys[_SLACK][0] < oldest:
            count = bisect_right(self._keys, (oldest, _START)) - 1
            del self._keys[:count], self._applied[:count], self._states[:count]


def _nothing(state: FilterState) -> None:
    """What was applied to the first state."""
