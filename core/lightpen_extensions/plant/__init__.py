"""The server of a plant: entries delivered, compared and fetched."""
