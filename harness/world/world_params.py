"""The parameters of the simulated world: one file of ``params/worlds``."""

from dataclasses import dataclass

from harness.world.cargo.params import CargoParams
from harness.world.people.body_params import PedestrianBodyParams
from harness.world.people.params import PedestrianParams
from harness.world.physics.params import ContactParams, PhysicsParams


@dataclass(frozen=True, slots=True)
class WorldParams:
    """A whole world: physics, people, contacts and cargo."""

    physics: PhysicsParams = PhysicsParams()
    people: PedestrianParams = PedestrianParams()
    pedestrian_bodies: PedestrianBodyParams = PedestrianBodyParams()
    contacts: ContactParams = ContactParams()
    cargo: CargoParams = CargoParams()
