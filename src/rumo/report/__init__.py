"""What reports are made of: figures, tables and pages."""
