"""DWB's critics by the names of Nav2, one file each."""

from navstack.control.dwb.critics.critic import Critic
from navstack.errors import UnknownNameError
from navstack.params.dwb import DwbParams
from navstack.params.extensions import algorithms
from navstack.params.registry.controllers import DWB_CRITICS


def build_critics(params: DwbParams) -> dict[str, Critic]:
    """The critics that ``params.critics`` names, in its order.

    A name may carry one of the default namespaces and the suffix ``Critic``, as in
    ``dwb_critics::PathDistCritic``, or be one of ``params.named_critics``.

    Raises:
        UnknownNameError: a name stands for no critic.
    """
    critics: dict[str, Critic] = {}
    table = algorithms("dwb_critics")
    for given in params.critics:
        if given in params.named_critics:
            named = params.named_critics[given]
            critics[given] = table[named.type].create(named.params, parts={"dwb": params})
            continue
        namespace, _, bare = given.rpartition("::")
        name = bare.removesuffix("Critic")
        if name not in DWB_CRITICS or (
            namespace and namespace not in params.default_critic_namespaces
        ):
            raise UnknownNameError("critic", given, DWB_CRITICS)
        critics[name] = table[name].create(getattr(params, name), parts={"dwb": params})
    return critics
