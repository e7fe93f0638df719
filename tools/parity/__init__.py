"""Parity with Nav2's own C++: recorded inputs and outputs, run through navstack and compared."""
