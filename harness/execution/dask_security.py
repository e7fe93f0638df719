"""Whether Dask's own configuration lets this program speak to a scheduler."""

from typing import Any

from distributed import Security
from distributed.comm.addressing import parse_address

from navstack.errors import InputError

ENCRYPTED = ("tls", "wss")  # schemes of addresses


def check_security(scheduler: str) -> None:
    """Check that Dask's own configuration lets this program speak to a scheduler.

    Raises:
        InputError: it does not.
    """
    settings = "distributed.comm.tls: ca-file, client.cert and client.key"
    try:
        read: Any = Security  # untyped
        security = read()
        has_certificate = security.get_connection_args("client")["ssl_context"] is not None
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"Dask's TLS cannot be used ({error}); correct its configuration, {settings}"
        ) from None
    is_encrypted = parse_address(scheduler)[0] in ENCRYPTED
    if is_encrypted and not has_certificate:
        raise InputError(
            f"--scheduler {scheduler} needs TLS; set it in Dask's configuration, {settings}"
        )
    if security.require_encryption and not is_encrypted:
        raise InputError(
            f"--scheduler {scheduler} has no TLS, which Dask's require-encryption demands; give "
            "tls://..."
        )
