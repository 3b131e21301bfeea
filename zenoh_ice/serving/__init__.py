"""The servant's side of calls: how they are received, executed one after another, and answered."""
