"""Being told to stop: a batch system's or a closing terminal's way to say Ctrl-C."""

import signal
import sys
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any

_AGAIN = 0.2  # [s] until a library that swallowed an interrupt is left
_told: list[int] = []  # signals by which this program was told to stop
_hooks: list[Callable[[Any], Any]] = []  # that hear of what is lost otherwise


def stop_like_ctrl_c() -> None:
    """Have SIGTERM and SIGHUP raise KeyboardInterrupt, unless they were ignored at the start.

    They and Ctrl-C are noted: a library may make another error of an interrupt, or nothing.
    """
    _told.clear()
    for name in ("SIGTERM", "SIGHUP", "SIGINT"):
        number = getattr(signal, name, None)
        usual = (signal.SIG_DFL, signal.default_int_handler)  # nohup's wish stands
        if number is not None and signal.getsignal(number) in usual:
            signal.signal(number, _interrupt)
    if sys.unraisablehook is not _pass_on:
        _hooks[:] = [sys.unraisablehook]
        sys.unraisablehook = _pass_on


def was_told_to_stop() -> bool:
    """Whether a signal said so since :func:`stop_like_ctrl_c`; who asks obeys it."""
    was_told = bool(_told)
    _told.clear()
    return was_told


def run_script(main: Callable[[], None]) -> None:
    """Run a script to its end; told to stop, it leaves with one line and status 130."""
    stop_like_ctrl_c()
    try:
        main()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(130)


def _interrupt(number: int, frame: FrameType | None) -> None:
    _told.append(number)
    raise KeyboardInterrupt


def _pass_on(lost: Any) -> None:
    """Raise an interrupt again that came while compiled code was calling back, where it is lost."""
    if _told and lost.exc_type is KeyboardInterrupt:
        again = threading.Timer(_AGAIN, _repeat)
        again.daemon = True
        again.start()
        return
    for hook in _hooks:
        hook(lost)


def _repeat() -> None:
    """Repeat the last signal, unless it was obeyed meanwhile."""
    if _told:
        signal.raise_signal(_told[-1])
