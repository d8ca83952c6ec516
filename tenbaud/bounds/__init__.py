"""What no code of R bit/s can do better than: `floor` first, then `linear`."""
