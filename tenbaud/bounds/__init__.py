"""The smallest error of any code of R bit/s: read `floor` first, then `linear`, `encoder`."""
