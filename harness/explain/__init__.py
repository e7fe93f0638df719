"""Why a delivery cost what it cost.

The seconds before each costed event, and what another parameter had saved.
"""
