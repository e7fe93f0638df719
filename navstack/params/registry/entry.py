"""One algorithm: everything that checking, building and compiling it takes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from navstack.params.registry.block import ParameterBlock

Params = type[Any]  # a frozen dataclass whose fields are named like the parameters


@dataclass(frozen=True, slots=True)
class AlgorithmEntry:
    """An algorithm by its type in a Nav2 file.

    One without ``make`` and ``params`` is Nav2's and not available here.
    """

    keys: ParameterBlock = ParameterBlock()  # what Nav2 declares, in any release
    # "module:name", imported when it is asked for; empty for a layer
    make: str | Callable[..., Any] = ""
    params: Params | None = None  # None: it has none
    # what ``make`` takes behind the parameters: names of :data:`build`'s parts
    needs: tuple[str, ...] = ()
    kernels: tuple[str, ...] = ()  # modules of compiled functions that it calls
    note: str = ""  # in what it is less than Nav2's
    # distributions of Nav2 that have it; none: a plugin of this program or of another package
    releases: tuple[str, ...] = ()

    @property
    def is_available(self) -> bool:
        """Whether it runs here."""
        return bool(self.make) or self.params is not None

    def create(self, *given: Any, parts: Mapping[str, Any]) -> Any:
        """The algorithm, made of its parameters and of the parts that it needs."""
        make = self.make
        if isinstance(make, str):
            module, _, name = make.partition(":")
            make = getattr(import_module(module), name)
        return make(*given, *(parts[name] for name in self.needs))


Family = Mapping[str, AlgorithmEntry]
