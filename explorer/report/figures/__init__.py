"""Charts of a report: pure functions from a result to a plotly specification in plain JSON types."""
