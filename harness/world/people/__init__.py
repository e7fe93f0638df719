"""Who walks: models of pedestrians, recorded ones, and the crowd that they form."""
