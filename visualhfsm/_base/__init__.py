"""What all rooms stand on: errors, languages, watched child processes, HTML files that stand alone.

Child processes answer questions (`line_process`), run tasks (`task_processes`) or report
(`reporting_process`), `output_lines` is their output in lines, and `work` is done alone for its document.
"""
