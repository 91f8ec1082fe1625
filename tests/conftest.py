"""Shared fixtures: nothing may leak from a test."""

import hypothesis

hypothesis.settings.register_profile("kempelen", derandomize=True, deadline=None)
hypothesis.settings.load_profile("kempelen")
