"""Controllers: from a plan and the surroundings to a velocity, and the checkers that watch them."""
