"""From tasks, which are plain data, to rows: in processes that may crash or hang."""
