"""What an audit checks: a table of claims, each of which owns the recorded fields that it verifies."""
