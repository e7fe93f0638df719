"""What is measured of a delivery, and how a run sums it up."""
