"""Costs that the paper leaves out: off unless asked for, and marked wherever they enter."""

from collections.abc import Collection
from dataclasses import dataclass

from harness.economics.cost_terms import OPTIONAL_TERMS, CostInputs
from harness.economics.measured import Measured, Quantity
from harness.economics.optional_prices import OptionalPrices
from harness.economics.prices import Prices
from navstack.errors import InputError, UnknownNameError


@dataclass(frozen=True, slots=True)
class ExtraCosts:
    """Costs that the paper leaves out, as far as a user wants them counted."""

    capex_usd: float = 0.0  # [USD]
    opex: Quantity = 0.0  # [USD/run]


SAME_WORK = ("operator", "operator_shift", "remote_assistance")  # of which one is paid

NO_EXTRA_COSTS: ExtraCosts = ExtraCosts()


@dataclass(frozen=True, slots=True)
class OptionalTerms:
    """Costs beyond the paper that a user wants counted."""

    names: tuple[str, ...]
    prices: OptionalPrices


def extra_costs(name: str, given: CostInputs) -> ExtraCosts:
    """What one optional term comes to."""
    term = OPTIONAL_TERMS[name]
    capex_usd = 0.0
    if term.investment is not None:
        capex_usd = term.investment(given)
    return ExtraCosts(capex_usd, term.formula(given))


def check_terms(names: Collection[str]) -> tuple[str, ...]:
    """The terms in their own order, each once.

    Raises:
        InputError: an unknown term, or two that pay for the same work.
    """
    for name in names:
        if name not in OPTIONAL_TERMS:
            raise UnknownNameError("optional term", name, OPTIONAL_TERMS)
    alike = [name for name in SAME_WORK if name in names]
    if len(alike) > 1:
        raise InputError(
            f"the optional terms {' and '.join(alike)} pay for the same work; give one of them"
        )
    return tuple(name for name in OPTIONAL_TERMS if name in names)


def together(terms: Collection[ExtraCosts]) -> ExtraCosts:
    """The sum of terms."""
    return ExtraCosts(
        capex_usd=sum(term.capex_usd for term in terms), opex=sum(term.opex for term in terms)
    )


def optional_costs(
    measured: Measured,
    localizer: str,
    prices: Prices,
    optional: OptionalTerms | None,
) -> dict[str, ExtraCosts]:
    """The optional terms, each by itself, of a run's means or of each delivery."""
    if optional is None:
        return {}
    given = CostInputs(measured, prices, optional.prices, localizer)
    return {name: extra_costs(name, given) for name in optional.names}


def all_optional_costs(
    measured: Measured,
    localizer: str,
    prices: Prices,
    optional: OptionalTerms | None,
) -> ExtraCosts:
    """The sum of the optional terms."""
    return together(optional_costs(measured, localizer, prices, optional).values())
