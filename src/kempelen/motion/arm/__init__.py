"""Motion for arms: whole steps, joint-synchronous and guided paths, the whole-arm sweep."""
