"""Public records that nobody of the project wrote, evaluated or refused (docs/public-records.md).

The records are not in the repository: clone the repositories that the page names into one folder, under the
names of :data:`tests.public_records.sources.SOURCES`, and name it in ``BUFFERSTAND_PUBLIC_RECORDS``.
"""
