"""A controller that compares many motions by the dollars that each is expected to cost."""
