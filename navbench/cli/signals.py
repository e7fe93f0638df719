"""Being told to stop: a batch system's or a closing terminal's way to say Ctrl-C."""

import signal
import sys
from collections.abc import Callable
from types import FrameType


def stop_like_ctrl_c() -> None:
    """Have SIGTERM and SIGHUP raise KeyboardInterrupt, unless they were ignored at the start."""
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:  # nohup's wish stands
            signal.signal(number, _interrupt)


def run_script(main: Callable[[], None]) -> None:
    """Run a script to its end; told to stop, it leaves with one line and status 130."""
    stop_like_ctrl_c()
    try:
        main()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(130)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
