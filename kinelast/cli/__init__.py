"""The deflection-report command: its options, what it prints, and scenes side by side."""
