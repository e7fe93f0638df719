"""The robot's brain: Nav2's navigation pipeline in Python, free of any simulator."""

from navstack.dispatch import pin

pin()
