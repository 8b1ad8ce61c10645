"""Random problems, random drives through them, and a judge of every step that shares nothing with the core."""
