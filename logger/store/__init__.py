"""What is kept on disks, in reading order; imports run the other way, and never back.

formats      files that people and programs exchange: drives, profiles, vehicles, effects, calibrations
log          the logger's own files, whole after any cut of the power
export       copies of them on sticks that may be pulled at any instant
integrity    whether what lies on a disk or a stick is what was written
"""
