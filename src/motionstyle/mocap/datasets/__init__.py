"""Where clips come from: the sheet of motions, pinned datasets, their doors, the wheel."""
