"""What a delivery is: stack, mission, seed."""
