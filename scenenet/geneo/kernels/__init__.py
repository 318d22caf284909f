"""One file a kernel. Each file found here is imported by the registry."""
