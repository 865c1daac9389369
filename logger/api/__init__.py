"""What programs and notebooks may use of all this; ``import ridelog`` gives it by name.

Inputs are records of arrays (``Run``, ``Profile``, ``Model``, ...), results frozen records of numbers. Whatever is
wrong with an input is raised as ``BadInput``, in one line; nothing is printed. What takes long to load is loaded
when it is first used.
"""
