"""What is poured for a diagnosis: the plan, its pours, and the order in which they are asked for."""
