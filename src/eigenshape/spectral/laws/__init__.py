"""What every operator must keep, checked on a given one."""
