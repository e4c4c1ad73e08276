"""What recorded runs mean: cycles, energies, stiffness, uncertainty, requirements, trends.

Pure functions from arrays to frozen facts. The way through the room::

    record.make_record(time_s, stroke_mm, force_kN, …) -> Record
    cycles.find_cycles(record) -> tuple[Cycle, …];  loops.cut_loop(record, cycle) -> Loop
    run.evaluate_run(record, facts: RunFacts, options: Options) -> RunEvaluation      (results.py)
    trends.find_trends(runs: Sequence[RunEvaluation]) -> tuple[Trend, …]
    load.load_run(path) -> (Record, RunFacts)
    document.evaluate_paths(paths, options, limit_set)       -> dict                  (the JSON document)
    table.cycle_table(document) -> pandas.DataFrame;  table.write_table(document, path)
"""
