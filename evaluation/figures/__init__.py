"""The figures of a report: builders make plot data, the painter makes SVG from it."""
