"""Whether what a price file says beside its prices is known: accounting, terms, their prices."""

from harness.economics.accountings import ACCOUNTINGS
from harness.economics.optional_prices import load_optional_prices
from harness.economics.optional_terms import check_terms
from harness.economics.prices import Prices
from navstack.errors import InputError, ParameterError, UnknownNameError


def check_set(prices: Prices, where: str) -> None:
    """Check a price file's accounting, its optional terms and its own prices of these.

    Raises:
        ParameterError: one that is not known, or cannot be used; names ``where``.
    """
    try:
        if prices.accounting not in ACCOUNTINGS:
            raise UnknownNameError("accounting of prices", prices.accounting, list(ACCOUNTINGS))
        check_terms(prices.terms)
        load_optional_prices(prices)
    except InputError as error:
        raise ParameterError(f"{where}: {error}") from None
