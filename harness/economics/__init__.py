"""What a delivery costs and earns: pure functions of measurements and prices."""
