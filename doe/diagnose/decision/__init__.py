"""From fits to a verdict: the gates, the race, and the tables that say why."""
