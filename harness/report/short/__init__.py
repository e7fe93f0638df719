"""What commands print by default: the answer first, in at most 25 lines."""
