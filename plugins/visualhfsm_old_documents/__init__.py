"""Documents of other editors and older ones: SCXML, VisualStates, and the Spanish editor of 2013."""
