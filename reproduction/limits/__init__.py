"""`tenbaud bench coders`: every coder against the floor. Read `entrants`, `flight`, then `page`."""
