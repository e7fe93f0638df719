"""What stands where: scenes, generated sidewalks and imported maps."""
