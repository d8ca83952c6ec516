"""Flying a recorded flight again from its symbols, and auditing what it rested on."""
