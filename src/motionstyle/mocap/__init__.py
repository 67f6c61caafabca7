"""From clip files to kinematic motions: readers, dataset doors, retargeting, contacts."""
