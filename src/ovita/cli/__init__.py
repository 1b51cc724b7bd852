"""The command line: `ovita adapt`, `chat`, `plot`, `explain`, `policy`, `demo`."""
