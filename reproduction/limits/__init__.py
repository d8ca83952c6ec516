"""`tenbaud bench coders`: every coder against the floor. Read `candidates`, `flight`, then `page`."""
