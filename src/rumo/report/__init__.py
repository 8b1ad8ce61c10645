"""Reports: figures, tables and pages, made from logs only."""
