"""What the published rows rest on: which parameters are free, how much each matters, and whether the rows come out."""
