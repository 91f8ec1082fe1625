"""Arms of stepper motors, behind a multi-axis G-code controller or the older machine's serial bridge."""
