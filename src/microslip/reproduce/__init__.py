"""The paper, figure by figure: every result computed again and laid beside what is printed.

`study` computes what figures share, once; a module per figure draws it and compares numbers;
`registry` lists the figures; `command` is the command line. Heavy modules are imported by the
ones that need them, so that importing this package costs nothing.
"""
