"""Contact laws: the force between two bodies that overlap."""
