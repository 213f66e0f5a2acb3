"""Running gear of vehicles, each by one call: tracks (`track`), laid around wheels (`track_path`)."""
