"""The workbench: what a kernel is, what it responds to, and a template for a new one."""
