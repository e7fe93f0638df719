"""Why a delivery cost what it cost: the seconds before each costed event, and what another parameter had saved."""
