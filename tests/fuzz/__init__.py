"""Fuzzing of everything that reads what others wrote: files, frames, requests.

`catalogue` lists the targets, `mutators` make inputs from samples, `running` judges how each input ends.
"""
