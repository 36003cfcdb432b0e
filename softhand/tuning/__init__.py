"""Numbers of a scenario turned until its runs cost less, over many worlds, and judged on others"""
