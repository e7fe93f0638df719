"""Commands whose margins are of meetings with people, not of whole deliveries."""
