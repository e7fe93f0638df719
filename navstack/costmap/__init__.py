"""Occupancy grids and layered costmaps, after nav2_map_server and nav2_costmap_2d."""
