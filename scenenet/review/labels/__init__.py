"""A review as labels: a copy of the survey in which people's towers are labelled tower."""
