"""From pours to a prediction with its error, anywhere in the sampled box."""
