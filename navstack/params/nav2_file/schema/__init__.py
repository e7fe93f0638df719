"""The parameters that Nav2's nodes and plugins declare, Foxy to Rolling, as data."""
