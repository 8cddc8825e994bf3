"""HTTP: the server of pages and streams, its access rules and certificates."""
