"""The workbench: what a kernel is, what it answers to, and a template for a new one."""
