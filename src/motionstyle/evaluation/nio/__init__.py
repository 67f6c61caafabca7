"""What learnt styles are measured by: tables, experiments and known truth of NIO (nio.md §7)."""
