"""The open benchmark of prioritized control: problems as files, entrants, judged answers."""
