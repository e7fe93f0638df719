"""DWB's critics by the names of Nav2, one file each."""

from collections.abc import Collection

from navstack.control.dwb.critics.critic import Critic
from navstack.errors import UnknownNameError
from navstack.params.dwb import DwbParams
from navstack.params.extensions import algorithms
from navstack.params.registry.controllers import DWB_CRITICS


def build_critics(params: DwbParams) -> dict[str, Critic]:
    """The critics that ``params.critics`` names, in its order; one named twice scores twice.

    A name may carry one of the default namespaces and the suffix ``Critic``, as in
    ``dwb_critics::PathDistCritic``, or be one of ``params.named_critics``.

    Raises:
        UnknownNameError: a name stands for no critic.
    """
    critics: dict[str, Critic] = {}
    table, parts = algorithms("dwb_critics"), {"dwb": params}
    for given in params.critics:
        if given in params.named_critics:
            named = params.named_critics[given]
            critics[_label(given, critics)] = table[named.type].create(named.params, parts=parts)
            continue
        namespace, _, bare = given.rpartition("::")
        name = bare.removesuffix("Critic")
        if name not in DWB_CRITICS or (
            namespace and namespace not in params.default_critic_namespaces
        ):
            raise UnknownNameError("critic", given, DWB_CRITICS)
        critics[_label(name, critics)] = table[name].create(getattr(params, name), parts=parts)
    return critics


def _label(name: str, taken: Collection[str]) -> str:
    """A critic's name, or where it is taken the name with a number."""
    label, number = name, 1
    while label in taken:
        number += 1
        label = f"{name}_{number}"
    return label
