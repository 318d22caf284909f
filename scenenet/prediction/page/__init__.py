"""The page of a survey: a map, the list of its towers, and each tower in plan and profile."""
