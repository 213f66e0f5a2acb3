"""Running gear of vehicles, each by one call: tracks (`track`)."""
