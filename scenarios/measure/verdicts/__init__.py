"""What a comparison comes to in words: who did what, what went wrong, what must be said."""
