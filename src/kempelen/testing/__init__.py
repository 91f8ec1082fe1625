"""For tests and for authors of drivers: fakes, contract suites, scripted wires."""
