"""How fast everything is: against plain numpy, recorded C++ and real time."""
