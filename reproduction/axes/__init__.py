"""The tables and pictures of docs/THREE-AXES.md."""
