"""What a process keeps of files between deliveries, until it is told to forget."""

import functools
import gc
import glob
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar

Given = ParamSpec("Given")
Made = TypeVar("Made")

_ALL: "list[Kept[Any, Any]]" = []
_READ: dict[Path, tuple[int, int]] = {}  # time of change [ns] and size of files that were read


class Kept(Generic[Given, Made]):
    """A function whose last results are kept; its arguments are hashable.

    Unlike :func:`functools.lru_cache` it lets the oldest result go before it makes another one:
    brains and worlds weigh hundreds of megabytes.
    """

    def __init__(self, make: Callable[Given, Made], most: int, is_heavy: bool) -> None:
        """Keep nothing yet.

        Args:
            make: the function.
            most: number of results kept.
            is_heavy: the memory of a result that goes is needed at once, and its parts know each
                other. Looking for them among all objects of the process takes a fifth of a second.
        """
        functools.update_wrapper(self, make)
        self._make, self._most, self._is_heavy = make, most, is_heavy
        self._lock = threading.Lock()
        self.cache_clear()

    def __call__(self, *given: Given.args, **named: Given.kwargs) -> Made:
        """The result, made now or earlier."""
        key: Hashable = (given, *sorted(named.items()))
        with self._lock:
            known = self._known
            if key in known:
                known.move_to_end(key)
                return known[key]
            is_full = len(known) >= self._most
            if is_full:
                known.popitem(last=False)
        if is_full and self._is_heavy:
            gc.collect()
        for each in (*given, *named.values()):
            if isinstance(each, str) and os.path.isfile(each):
                _remember(Path(each))
        made = known[key] = self._make(*given, **named)
        return made

    def cache_clear(self) -> None:
        """Keep nothing of what was made, nor of what another thread is making just now."""
        self._known: OrderedDict[Hashable, Made] = OrderedDict()


def kept(most: int, is_heavy: bool = False) -> Callable[[Callable[Given, Made]], Kept[Given, Made]]:
    """Keep the last results of a function that reads files, or takes what another made of them."""

    def keep(make: Callable[Given, Made]) -> Kept[Given, Made]:
        _ALL.append(Kept(make, most, is_heavy))
        return _ALL[-1]

    return keep


def forget() -> None:
    """Read files anew, and build anew what is made of them.

    What is at work just now goes on as it is.
    """
    for each in _ALL:
        each.cache_clear()
    _READ.clear()


def forget_changed() -> None:
    """The same, if a file that was read has changed since, or the image of a map."""
    if any(_stamp(file) != stamp for file, stamp in list(_READ.items())):
        forget()


def _remember(file: Path) -> None:
    """Note a file that is read, and those beside it of the same name, as a map's image."""
    for each in (file, *file.parent.glob(f"{glob.escape(file.stem)}.*")):
        _READ[each] = _stamp(each)


def _stamp(file: Path) -> tuple[int, int]:
    try:
        found = file.stat()
    except OSError:
        return (0, 0)
    return (found.st_mtime_ns, found.st_size)
