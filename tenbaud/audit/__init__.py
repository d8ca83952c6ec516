"""The checks of an audit: a table of claims, each of which owns the fields that it verifies."""
