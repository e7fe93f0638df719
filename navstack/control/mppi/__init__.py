"""Model predictive path integral control, after nav2_mppi_controller."""
