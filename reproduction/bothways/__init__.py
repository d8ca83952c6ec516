"""The study of both directions: a narrow downlink beside the exact one. Makes docs/BOTHWAYS.md."""
