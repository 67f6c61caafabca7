"""What both ways to a motion share: body, virtual markers, floor, contacts, the fit itself."""
