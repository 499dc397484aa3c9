"""Users, tokens, sessions, their shares, and what they changed."""
