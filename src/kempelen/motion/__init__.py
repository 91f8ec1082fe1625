"""Paths over the standing pieces, their timing and the swept test. Pure numpy."""
