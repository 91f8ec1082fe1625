"""Drivers: one package for each kind of machine, and the hand that carries pieces with any of them."""
