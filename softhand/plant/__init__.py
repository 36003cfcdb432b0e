"""Hand, object and contacts as one system of differential equations."""
