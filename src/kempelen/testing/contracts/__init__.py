"""Contract suites: what every driver of a kind must do, on real protocol and twin alike."""
