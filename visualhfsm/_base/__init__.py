"""What all rooms stand on: errors, languages, watched child processes, HTML files that stand alone."""
