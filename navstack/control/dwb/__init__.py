"""The DWB local planner, after nav2_dwb_controller."""
