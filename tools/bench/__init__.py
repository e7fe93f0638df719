"""How fast everything is: components against plain numpy and recorded C++, deliveries against real time."""
