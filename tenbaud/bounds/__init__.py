"""The theoretical minimum of the error at R bit/s: `floor` first, then `linear`."""
