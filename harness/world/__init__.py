"""The physical world: robot, sensors, people, street furniture and cargo."""
