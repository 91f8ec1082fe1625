"""Programs that think: UCI engines, how they are found and how strongly they play."""
