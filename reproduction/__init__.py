"""Makes the project's own pages: the paper's figures, and how near each coder comes to the limit."""
