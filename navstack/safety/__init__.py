"""What stands between the controller and the wheels."""
