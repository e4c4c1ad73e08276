"""Is this installation's evaluation right? Standard data sets with agreed values, and the record of it.

ISO/IEC 17025:2017, 7.11.2 asks that software is validated before it is used. The sets are a folder of records
and truth files that any other program can be judged by, too (docs/validation.md).
"""
