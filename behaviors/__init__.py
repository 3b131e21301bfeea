"""The paper's three experiments: documents and the components generated from them."""
