"""Whether a flight rested on its paid symbols alone: a table of claims over what both ends recorded."""
