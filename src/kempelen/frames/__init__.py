"""Frames between processes and on disk: the shared-memory ring, control messages, recordings."""
