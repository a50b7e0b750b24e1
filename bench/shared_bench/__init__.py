"""One narrow link that several streams share, in network namespaces."""
